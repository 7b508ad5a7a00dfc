//! Test support: a KITTI-like camera, drives with exact poses, a street of points, images of a street, vehicles on a level road,
//! fields of protobuf messages, tiny networks, damaged files, and the folder of development data. A dev-dependency only.
//!
//! ```
//! use motorcade_testing::{CAMERA, Drive, project, street};
//! let drive = Drive::straight(20, 10.0, 8.0);
//! assert_eq!(drive.world_from_camera[10].translation().z, 8.0);
//! let seen = street().iter().filter(|p| project(&CAMERA, &drive.world_from_camera[0], p).is_some()).count();
//! assert!(seen > 100);
//! ```

mod drive;
pub mod fuzz;
mod on_road;
pub mod onnx;
pub mod protobuf;
mod shared;
mod street;
pub mod street_image;

use motorcade_geometry::PinholeCamera;

pub use drive::Drive;
pub use on_road::on_road;
pub use shared::shared;
pub use street::{project, street};

/// A camera like KITTI's rectified colour cameras.
pub const CAMERA: PinholeCamera =
    PinholeCamera { fx: 720.0, fy: 720.0, cx: 600.0, cy: 180.0, width: 1242, height: 375 };

/// Height of that camera above the road \[m\].
pub const CAMERA_HEIGHT_M: f64 = 1.65;
