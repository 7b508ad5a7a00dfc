//! Geometry of driving video: frames, Lie groups, cameras, planes and robust estimation.
//!
//! No input or output, no threads, no images. Conventions are fixed for the whole project:
//!
//! - camera x right, y down, z forward; vehicle x forward, y left, z up, origin on the road below the body centre;
//! - transforms read `a_from_b`, points `point_in_a`; [`Pose<To, From>`](Pose) makes a wrong composition a compile error;
//! - tangent vectors are `[ω, ν]` (rotation first), perturbations act on the right: `T · exp(δ)`;
//! - metres, radians, pixels with centres at integer coordinates.
//!
//! ```
//! use motorcade_geometry::{Camera, Pose, Vehicle, World};
//! let world_from_camera = Pose::<World, Camera>::identity();
//! let camera_from_vehicle = Pose::<Camera, Vehicle>::identity();
//! let world_from_vehicle: Pose<World, Vehicle> = world_from_camera * camera_from_vehicle;
//! assert_eq!(world_from_vehicle.translation().norm(), 0.0);
//! ```

mod absolute_pose;
pub mod alignment;
mod bounding_box;
mod camera;
mod distorted_camera;
mod distortion;
pub mod five_point;
pub mod lie;
mod mahalanobis;
pub mod numeric;
mod p3p;
mod polynomial;
mod pose;
mod relative_pose;
mod road_plane;
pub mod robust;
pub mod rts;
mod triangulation;

pub use absolute_pose::{AbsolutePose, AbsolutePoseOptions, Sighting, absolute_pose, projection_jacobian};
pub use bounding_box::BoundingBox;
pub use camera::{InvalidCamera, PinholeCamera};
pub use distorted_camera::DistortedCamera;
pub use distortion::{Distortion, Fisheye, RadialTangential, Rational};
pub use mahalanobis::mahalanobis_squared;
pub use p3p::p3p;
pub use pose::{Camera, Frame, Pose, Vehicle, World};
pub use relative_pose::{RelativePose, RelativePoseOptions, relative_pose};
pub use road_plane::RoadPlane;
pub use triangulation::{triangulate_midpoint, triangulate_rays};
