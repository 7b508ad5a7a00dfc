//! Draws what was estimated into the frames of a drive: pixels and a [`Scene`] in, pixels out. No files, no threads.
//!
//! Three types to know: [`Overlay`] draws frames of one camera, [`Scene`] is the estimate of one frame, [`SceneVehicle`] a vehicle
//! of it. The same frame and scene give the same bytes.
//!
//! In the image: a metric grid on the road, the last seconds of moving vehicles on the road, every vehicle as a cuboid with its
//! front filled, and a label. Beside the image: the map from above and the state of the camera.
//!
//! - Solid lines are moving vehicles, dashed ones parked; edges behind the body are fainter, vehicles that were only predicted in
//!   this frame or that may be none are fainter as a whole, with a short label. A speed with a question mark is that of a vehicle
//!   that may stand.
//! - The outline of a vehicle is [`outline_width_px`] wide, which grows with the standard deviation of its position.
//! - `±` in text is one standard deviation, ellipses on the map are two.
//!
//! ```
//! use image::RgbImage;
//! use motorcade_draw::{Overlay, Scene};
//! use motorcade_geometry::{PinholeCamera, RoadPlane};
//!
//! let camera = PinholeCamera { fx: 390.0, fy: 390.0, cx: 240.0, cy: 105.0, width: 480, height: 240 };
//! let overlay = Overlay::new(camera);
//! let scene = Scene {
//!     number: 7,
//!     time_s: 0.7,
//!     status: None,
//!     speed_mps: 9.8,
//!     speed_sigma_mps: Some(0.2),
//!     road: RoadPlane::level(1.5),
//!     vehicles: Vec::new(),
//! };
//! let drawn = overlay.draw(&RgbImage::new(480, 240), &scene);
//! assert_eq!(drawn.dimensions(), overlay.size());
//! ```

mod canvas;
mod colour;
mod cuboid;
mod glyphs;
mod grid;
mod label;
mod layout;
mod map;
mod outline;
mod overlay;
mod panel;
mod placement;
mod scene;
mod segment;
mod text;
mod trail;
mod vehicle;
mod view;

pub use outline::visible_edges;
pub use overlay::Overlay;
pub use scene::{Scene, SceneVehicle};
pub use vehicle::outline_width_px;
