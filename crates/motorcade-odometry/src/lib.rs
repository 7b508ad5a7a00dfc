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

mod buffer;
mod map;
mod odometry;
mod road;
mod scale;
mod tracking;
mod trajectory;

pub use map::{BundleOptions, Landmark, PoseOnlyOptions, WindowOptions};
pub use odometry::{Odometry, OdometryOptions, PolicyOptions};
pub use road::{
    ClosedFormScale, Reading, RoadCurvature, RoadInput, RoadMeasurement, RoadOptions, RoadPlane, RoadTracker,
    ScaleAverage, road_normal,
};
pub use scale::{EgoFrame, EgoTrajectory, NoiseModel, Uncertainty};
pub use tracking::{
    CornerOptions, KltOptions, Plane, Pyramid, Request, StaticMask, detect, track, track_checked,
};
pub use trajectory::{FrameRecord, FrameStatus, OdometryTrajectory};

/// Stages by themselves, for the benchmarks; no promise is made of them.
#[doc(hidden)]
pub mod stages {
    pub use crate::map::{BundleProblem, Sighting};
    pub use crate::map::{Observation, PoseRefiner};
    pub use crate::road::{RoadPixels, RoadScratch, RoadView, align_road};
}
