//! A software renderer: triangles into a 2×2 supersampled visibility buffer, each visible surface shaded once a pixel
//! with textures filtered to the pixel's footprint.

mod air;
mod facade;
mod ground;
mod lighting;
mod look;
mod mesh;
mod options;
mod picture;
mod rain;
mod raster;
mod renderer;
mod repairs;
mod resolve;
mod sensor;
mod shade;
mod shadow;
mod sky;
mod tile;
mod varied_mesh;
mod varied_paint;
mod vehicle_mesh;
mod vehicle_paint;
mod weather;
mod window;

pub(crate) use ground::{KERB_M, PAVEMENT_M};
pub use look::Look;
pub(crate) use mesh::{Building, Chunk, Material, Mesh, Vertex};
pub use options::{RenderOptions, SensorOptions};
pub use picture::{Picture, VehicleView};
pub use renderer::Renderer;
pub(crate) use renderer::projected;
pub(crate) use shade::Textures;
pub(crate) use vehicle_mesh::mesh as vehicle_mesh;
pub use weather::Weather;
