//! Monocular odometry for driving video, metric by the height of the camera above the road.
//!
//! Three types to know: [`Odometry`] follows corners and gives camera motion up to scale, [`RoadTracker`] finds the road
//! plane in the same images, [`EgoTrajectory`] puts both together into metres.
//!
//! ```
//! use image::GrayImage;
//! use motorcade_geometry::PinholeCamera;
//! use motorcade_odometry::{
//!     EgoTrajectory, Odometry, OdometryOptions, RoadOptions, RoadInput, RoadTracker, StaticMask,
//! };
//!
//! let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 160.0, cy: 80.0, width: 320, height: 160 };
//! let mut odometry = Odometry::new(camera, OdometryOptions::default());
//! let mut road = RoadTracker::new(camera, RoadOptions::default());
//! for frame in 0..3 {
//!     let pyramid = odometry.process(&GrayImage::new(320, 160), &StaticMask::default());
//!     let so_far = odometry.so_far();
//!     let segment = so_far.frames[frame].segment;
//!     let sight = RoadInput { pyramid: &pyramid, vehicles: &[], masked: false };
//!     road.process(frame, segment, &sight, |k| so_far.camera_from_world(k), |_| true);
//! }
//! // Black images: nothing is known, but every frame is there.
//! let ego = EgoTrajectory::new(&odometry.finish(), road.measurements(), 1.65);
//! assert_eq!(ego.frames.len(), 3);
//! ```

mod bundle;
mod closed_form;
mod corners;
mod ego;
mod klt;
mod landmark;
mod nearby_depths;
mod odometry;
mod on_road;
mod options;
mod pose_only;
mod pyramid;
mod pyramid_pool;
mod record;
mod road;
mod road_measurement;
mod road_pixels;
mod road_profile;
mod road_track;
mod scale_smoother;
mod static_mask;
mod uncertainty;
mod window;

pub use bundle::BundleOptions;
pub use closed_form::{ClosedFormScale, ScaleAverage};
pub use corners::{CornerOptions, detect};
pub use ego::{EgoFrame, EgoTrajectory};
pub use klt::{KltOptions, Request, track, track_checked};
pub use landmark::Landmark;
pub use odometry::Odometry;
pub use options::{OdometryOptions, PolicyOptions};
pub use pose_only::PoseOnlyOptions;
pub use pyramid::{Plane, Pyramid};
pub use record::{FrameRecord, FrameStatus, OdometryTrajectory};
pub use road::{RoadOptions, RoadPlane};
pub use road_measurement::{Reading, RoadCurvature, RoadMeasurement, road_normal};
pub use road_track::{RoadInput, RoadTracker};
pub use scale_smoother::NoiseModel;
pub use static_mask::{Rectangle, StaticMask};
pub use uncertainty::Uncertainty;
pub use window::WindowOptions;

/// Stages by themselves, for the benchmarks; no promise is made of them.
#[doc(hidden)]
pub mod stages {
    pub use crate::bundle::{BundleProblem, Sighting};
    pub use crate::pose_only::{Observation, PoseRefiner};
    pub use crate::road::{RoadScratch, RoadView, align_road};
    pub use crate::road_pixels::RoadPixels;
}
