//! Estimates in the rerun viewer while the drive runs. Empty without the feature `rerun`.
//!
//! | entity | content |
//! |---|---|
//! | `world/camera` | `world_from_camera` |
//! | `world/camera/image` | pinhole camera, every frame as JPEG |
//! | `world/camera_path` | the last positions of the camera |
//! | `world/vehicles` | vehicles as boxes with id, class and speed; parked ones darker |
//! | `speed/camera`, `speed/vehicle/<id>` | speeds \[m/s\] |
//! | `distance/<id>` | distance from the camera to the vehicle's middle \[m\] |
//!
//! `world` and `camera` have x right, y down, z forward. Timelines: `frame`, the input's own number, and `time`, from the first frame.

#[cfg(feature = "rerun")]
mod live;
#[cfg(feature = "rerun")]
mod scene;

#[cfg(feature = "rerun")]
pub use live::{Error, Live, Target};
