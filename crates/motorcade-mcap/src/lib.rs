//! A run as an MCAP recording with Foxglove's schemas (protobuf), for Foxglove, rerun and everything that reads MCAP.
//!
//! | topic | schema | content |
//! |---|---|---|
//! | `/camera/image` | `foxglove.CompressedImage` | every frame as JPEG |
//! | `/camera/calibration` | `foxglove.CameraCalibration` | pinhole camera of the (undistorted) frames |
//! | `/camera/annotations` | `foxglove.ImageAnnotations` | vehicles as cuboids with labels \[px\] |
//! | `/camera/pose` | `foxglove.PoseInFrame` | `world_from_camera` |
//! | `/camera/path` | `foxglove.PosesInFrame` | the whole way, once |
//! | `/tf` | `foxglove.FrameTransforms` | `map` → `world` → `camera` |
//! | `/vehicles` | `foxglove.SceneUpdate` | vehicles as cuboids with labels and their way so far |
//! | `/speeds` | JSON | the row of `speeds.csv` |
//!
//! Frames: `world` and `camera` have x right, y down, z forward; `map` is `world` turned so that z is up (x forward, y left).
//! Vehicles are drawn in `world`. Times are those of the frames \[ns\]. The same run gives the same bytes.

mod annotations;
mod camera;
mod colour;
mod convert;
mod error;
mod speeds;
mod vehicles;
mod writer;

pub use error::Error;
pub use writer::Recording;
