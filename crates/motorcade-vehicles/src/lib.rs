//! Vehicles from their image boxes: data association, positions on the road, motion.
//!
//! Three types to know: a [`GroundFrame`] is one camera pose with the road under it, a [`Track`] the boxes of one vehicle,
//! a [`VehicleTrajectory`] its states in the world with size, speed, heading and P(moving). The flow: [`track_vehicles`] links
//! boxes, [`estimate_track`] places them on the road and smooths them. [`BoxFit`] positions a single box:
//!
//! ```
//! use motorcade_geometry::{PinholeCamera, Pose};
//! use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
//! use motorcade_vehicles::{BoxFit, BoxFitOptions, GroundFrame, ObservedBox, size_prior};
//! use nalgebra::Vector3;
//!
//! let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 600.0, cy: 180.0, width: 1242, height: 375 };
//! let ground = GroundFrame {
//!     world_from_camera: Pose::identity(), up: -Vector3::y(), height_m: 1.65, pitch_sigma_rad: 0.002,
//!     slope_change_sigma_rad: 0.0, road_ahead: None, time_s: 0.0,
//! };
//! let bbox = BoundingBox { x1: 570.0, y1: 184.0, x2: 631.0, y2: 240.0 };
//! let detection =
//!     Detection { class: VehicleClass::Car, score: 0.9, bbox, convention: BoxConvention::VisibleExtent, external_id: None, pixel_size: 1.0, road_below: None };
//! let options = BoxFitOptions::default();
//! let observed = ObservedBox::new(&detection, &camera, &[], &options);
//! let fit = BoxFit { camera: &camera, ground: &ground, options: &options };
//! let car = fit.locate(&observed, 0.0, &size_prior(VehicleClass::Car)).unwrap();
//! assert!((car.position_in_camera.z - 21.0).abs() < 1.5);
//! ```

mod box_fit;
mod clutter;
mod doubles;
mod estimate;
mod external;
mod ground;
mod hiding;
mod hilliness;
mod joint_size;
mod met_again;
mod motion;
mod observed_box;
mod one_place;
mod options;
mod outline;
mod road_ahead;
mod size_prior;
#[cfg(test)]
mod test_vehicles;
mod time;
mod track;
mod tracker;
mod trajectory;
mod way;

pub use box_fit::{BoxFit, SingleView};
pub use clutter::without_clutter;
pub use doubles::without_doubles;
pub use estimate::{
    SizeOfClass, estimate_consistently, estimate_track, explain_boxes, join_parted, sizes_by_class,
};
pub use external::{
    ExternalTrack, ExternalView, KeypointFitters, KeypointTrack, KeypointViews, SizeDependence,
    external_tracks,
};
pub use ground::GroundFrame;
pub use hiding::with_hiding_checked;
pub use hilliness::measure_slope_changes;
pub use joint_size::SizeByRoad;
pub use met_again::join_met_again;
pub use motion::{KinematicState, PositionMeasurement, probability_moving, smooth_motion, static_position};
pub use motorcade_shape::{Dimensions, SizePrior};
pub use observed_box::ObservedBox;
pub use one_place::join_in_one_place;
pub use options::{
    AdvancedVehicleOptions, BoxFitOptions, ClassOptions, ExternalViewOptions, HeadingOptions,
    HypothesisOptions, KeypointViewOptions, KinematicStateOptions, MetAgainOptions, MotionOptions,
    SizeOptions, TrafficSide, VehicleOptions,
};
pub use outline::{box_in_picture, image_box, upright_pose};
pub use road_ahead::RoadAhead;
pub use size_prior::size_prior;
pub use track::{Track, TrackBox, boxes_of};
pub use tracker::{
    AdvancedTrackerOptions, Tracker, TrackerOptions, TrackerState, track_both_ways, track_vehicles,
};
pub use trajectory::{
    PoseObservation, RivalState, Scaling, Source, VehicleMeasurement, VehicleState, VehicleTrajectory,
};
pub use way::measure_road_ahead;
