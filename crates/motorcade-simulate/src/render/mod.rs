//! A software renderer: triangles into a 2×2 supersampled visibility buffer, each visible surface shaded once a pixel
//! with textures filtered to the pixel's footprint.

mod air;
mod colour;
mod conditions;
mod coverage;
mod facade;
mod ground;
mod lighting;
mod look;
mod low_sun;
mod mirror;
mod night;
mod picture;
mod rain;
mod raster;
mod renderer;
mod repairs;
mod resolve;
mod scene;
mod sensor;
mod shade;
mod shadow;
mod sky;
mod surface_pixel;
mod textures;
mod tile;
mod tunnel;
mod varied_mesh;
mod varied_paint;
mod vehicle_mesh;
mod vehicle_paint;
mod window;

pub use picture::{Picture, VehicleView};
pub use renderer::Renderer;
pub(crate) use renderer::projected;
pub(crate) use textures::Textures;
pub(crate) use vehicle_mesh::mesh as vehicle_mesh;
