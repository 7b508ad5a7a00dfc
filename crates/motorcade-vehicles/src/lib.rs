//! Vehicles from their image boxes.
//!
//! Three types to know: a [`GroundFrame`] is one camera pose with the road under it, a [`Track`] the boxes of one vehicle,
//! a [`VehicleTrajectory`] its way through the world with size, speed, heading and P(moving). The flow:
//! [`track_vehicles`] links boxes, [`estimate_track`] places them on the road and smooths them.
//!
//! ```
//! use motorcade_geometry::{PinholeCamera, Pose};
//! use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
//! use motorcade_vehicles::{GroundFrame, ObservedBox, locate, size_prior};
//! use nalgebra::Vector3;
//!
//! let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 600.0, cy: 180.0, width: 1242, height: 375 };
//! let ground = GroundFrame {
//!     world_from_camera: Pose::identity(), up: -Vector3::y(), height_m: 1.65, pitch_sigma_rad: 0.002, time_s: 0.0,
//! };
//! let bbox = BoundingBox { x1: 570.0, y1: 184.0, x2: 631.0, y2: 240.0 };
//! let detection =
//!     Detection { class: VehicleClass::Car, score: 0.9, bbox, convention: BoxConvention::VisibleExtent, external_id: None };
//! let seen = ObservedBox::new(&detection, &camera, &[]);
//! let car = locate(&camera, &ground, &seen, 0.0, &size_prior(VehicleClass::Car)).unwrap();
//! assert!((car.position_in_camera.z - 21.0).abs() < 1.5);
//! ```

mod estimate;
mod ground;
mod headings;
mod joint_size;
mod motion;
mod silhouette;
mod single_view;
mod size;
mod states;
mod tracker;
mod trajectory;
mod views;

pub use estimate::estimate_track;
pub use ground::GroundFrame;
pub use motion::{KinematicState, PositionMeasurement, probability_moving, smooth_motion, standing_place};
pub use motorcade_shape::{Dimensions, SizePrior};
pub use silhouette::{image_box, standing_pose};
pub use single_view::{ObservedBox, SingleView, locate};
pub use size::size_prior;
pub use tracker::{Track, TrackBox, Tracker, TrackerOptions, track_vehicles};
pub use trajectory::{
    BySize, ExternalTrack, ExternalView, Scaling, Sighting, Source, TrafficSide, VehicleMeasurement,
    VehicleState, VehicleTrajectory,
};
