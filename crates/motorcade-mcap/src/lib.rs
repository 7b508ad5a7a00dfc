//! A run as an MCAP recording: with Foxglove's schemas (protobuf) for Foxglove, rerun and everything that reads MCAP, or with the messages of
//! ROS 2's common interfaces (CDR) for `ros2 bag`, RViz and Foxglove.
//!
//! With [`Schemas::Foxglove`]:
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
//! With [`Schemas::Ros2`]:
//!
//! | topic | message | content |
//! |---|---|---|
//! | `/camera/image/compressed` | `sensor_msgs/CompressedImage` | every frame as JPEG |
//! | `/camera/camera_info` | `sensor_msgs/CameraInfo` | pinhole camera of the (undistorted) frames |
//! | `/camera/pose` | `geometry_msgs/PoseWithCovarianceStamped` | `world_from_camera` |
//! | `/camera/path` | `nav_msgs/Path` | the whole way, once |
//! | `/tf` | `tf2_msgs/TFMessage` | `map` → `world` → `camera` |
//! | `/vehicles` | `visualization_msgs/MarkerArray` | vehicles as cuboids with labels and their way so far |
//! | `/speeds/<column>` | `std_msgs/Float64` | each number of `speeds.csv` |
//!
//! Frames: `world` and `camera` have x right, y down, z forward; `map` is `world` turned so that z is up (x forward, y left).
//! Vehicles are drawn in `world`. Times are those of the frames \[ns\]. The same run gives the same bytes.

mod drive;
mod error;
mod file;
mod foxglove;
mod frames;
mod label;
mod picture;
mod recording;
mod ros2;
mod speeds;

pub use error::Error;
pub use recording::{Recording, Schemas};
