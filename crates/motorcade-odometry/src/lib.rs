//! Monocular odometry for driving video, metric by the height of the camera above the road.
//!
//! Three types to know: [`Odometry`] tracks corners and gives camera motion up to scale, [`RoadTracker`] measures the road
//! plane in the same images, [`EgoTrajectory`] combines both into metres.
//!
//! ```
//! use image::GrayImage;
//! use motorcade_geometry::PinholeCamera;
//! use motorcade_odometry::{
//!     EgoTrajectory, MetricOptions, Odometry, OdometryOptions, RoadFeedback, RoadInput, RoadOptions, RoadTracker, StaticMask,
//! };
//!
//! let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 160.0, cy: 80.0, width: 320, height: 160 };
//! let mut odometry = Odometry::new(camera, OdometryOptions::default());
//! let mut road = RoadTracker::new(camera, RoadOptions::default());
//! for frame in 0..3 {
//!     let timestamp_ns = frame as i64 * 100_000_000;
//!     let pyramid = odometry.process(timestamp_ns, &GrayImage::new(320, 160), &StaticMask::default());
//!     let trajectory = odometry.trajectory();
//!     let segment = trajectory.frames[frame].segment;
//!     let input = RoadInput { frame, timestamp_ns, segment, pyramid: &pyramid, vehicles: &[], masked: false };
//!     let measured = road.process(&input, |k| trajectory.measured_pose(k), |_| true);
//!     odometry.apply_road(&RoadFeedback { measurement: measured.as_ref(), plane: road.plane(), vehicles: &[] });
//! }
//! // Black images: nothing is known, but every frame has an estimate.
//! let ego = EgoTrajectory::new(&odometry.finish(), road.measurements(), 1.65, &MetricOptions::default());
//! assert_eq!(ego.frames.len(), 3);
//! ```
//!
//! Modules, lowest first: `tracking` (pyramids, corners, KLT), `map` (landmarks, bundle adjustment), `road` (alignment,
//! measurements), `scale` (metres), `odometry` (the step).

mod buffer;
mod map;
mod odometry;
mod road;
mod rolling_shutter;
mod rows;
mod scale;
mod time;
mod tracking;
mod trajectory;

pub use map::{BundleOptions, Carrier, Landmark, PictureShiftOptions, PoseOnlyOptions, WindowOptions};
pub use odometry::{
    AdvancedOdometryOptions, FeedbackOptions, Odometry, OdometryOptions, OdometryState, PolicyOptions,
    RoadFeedback, ShiftedFrame,
};
pub use road::{
    AdvancedClosedFormOptions, AdvancedRoadOptions, AlignedRoad, AlignmentOptions, ClosedFormOptions,
    ClosedFormScale, ClosedFormState, HeightOptions, MirrorOptions, MirroredFrames, PlaneTrackingOptions,
    ProfileOptions, RoadCurvature, RoadEstimate, RoadInput, RoadMeasurement, RoadOptions, RoadState,
    RoadTracker, RoadTrackerState, ScaleAverage, road_normal, road_tilt,
};
pub use rows::Rows;
pub use scale::{
    EgoFrame, EgoTrajectory, MetricOptions, NoiseModel, ScaleMeasurement, SmootherOptions, Uncertainty,
};
pub use tracking::{
    AdvancedKltOptions, CornerOptions, KltOptions, Pyramid, PyramidLevel, Request, StaticMask, detect, track,
    track_checked,
};
pub use trajectory::{ExternalTrajectoryOptions, FrameRecord, FrameStatus, OdometryTrajectory};

/// Single stages, for the benchmarks; not a stable interface.
#[doc(hidden)]
pub mod stages {
    pub use crate::map::{
        BaselineLength, BundleProblem, BundleReport, KeyframeObservation, Observation, PoseEstimate,
        PoseRefiner, RoadPoint,
    };
    pub use crate::road::{RoadPixels, RoadScratch, RoadView, align_road};
}
