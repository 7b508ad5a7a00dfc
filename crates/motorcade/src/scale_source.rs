//! Source of metric scale: the aligned road, the paper's closed form, both, or none.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use motorcade_odometry::{
    ClosedFormOptions, ClosedFormScale, ClosedFormState, EgoTrajectory, MirroredFrames, OdometryTrajectory,
    RoadInput, RoadMeasurement, RoadTracker, RoadTrackerState,
};
use nalgebra::{Point2, Vector3};

use crate::config::{Config, ScaleOptions};

/// The height that T of the paper is given for \[m\]: KITTI's.
const PAPER_HEIGHT_M: f64 = 1.65;

/// Measurements that are taken out at least: many at once.
const TAKEN_OUT: usize = 256;

/// Way to measure scale on the road.
pub(crate) enum ScaleSource {
    Aligned(Box<RoadTracker>),
    ClosedForm(Box<ClosedFormScale>),
    /// The closed form in frames in which the road was not aligned.
    Both(Box<RoadAndPoints>),
    Unmeasured,
}

/// State of a source of scale between two frames.
#[derive(serde::Serialize, serde::Deserialize)]
pub(crate) enum ScaleState {
    Aligned(Box<RoadTrackerState>),
    ClosedForm(ClosedFormState),
    Both(Box<(RoadTrackerState, ClosedFormState, Vec<RoadMeasurement>)>),
    Unmeasured,
}

/// The aligned road with the closed form as its substitute.
pub(crate) struct RoadAndPoints {
    road: RoadTracker,
    points: ClosedFormScale,
    measurements: Vec<RoadMeasurement>,
}

impl RoadAndPoints {
    fn process(
        &mut self,
        input: &RoadInput<'_>,
        pose_of: impl Fn(usize) -> Option<Pose<Camera, World>>,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<RoadMeasurement> {
        let aligned = self.road.process(input, &pose_of, &usable);
        let measured = aligned.or(self.points.process(input, &pose_of, &usable));
        self.measurements.extend(measured);
        measured
    }

    fn forget_before(&mut self, row: usize) -> Vec<RoadMeasurement> {
        self.road.forget_before(row);
        self.points.forget_before(row);
        let old = self.measurements.partition_point(|m| m.frame < row);
        let old = old.min(self.measurements.len().saturating_sub(1));
        self.measurements.drain(..if old < TAKEN_OUT { 0 } else { old }).collect()
    }
}

impl ScaleSource {
    pub(crate) fn new(camera: PinholeCamera, config: &Config) -> Self {
        let scale = &config.scale;
        let points = || ClosedFormScale::new(camera, closed_form_options(scale));
        let road = || RoadTracker::new(camera, config.road);
        match scale {
            ScaleOptions { road: false, .. } => Self::Unmeasured,
            ScaleOptions { closed_form: true, .. } => Self::ClosedForm(Box::new(points())),
            ScaleOptions { points: true, .. } => {
                let (road, points) = (road(), points());
                Self::Both(Box::new(RoadAndPoints { road, points, measurements: Vec::new() }))
            }
            _ => Self::Aligned(Box::new(road())),
        }
    }

    /// The state after the last frame.
    pub(crate) fn state(&self) -> ScaleState {
        match self {
            Self::Aligned(road) => ScaleState::Aligned(Box::new(road.state())),
            Self::ClosedForm(scale) => ScaleState::ClosedForm(scale.state()),
            Self::Both(both) => {
                let RoadAndPoints { road, points, measurements } = &**both;
                ScaleState::Both(Box::new((road.state(), points.state(), measurements.clone())))
            }
            Self::Unmeasured => ScaleState::Unmeasured,
        }
    }

    /// As after the frame of a state; `None` of one that another configuration made.
    pub(crate) fn resumed(&self, camera: PinholeCamera, config: &Config, state: ScaleState) -> Option<Self> {
        let (road_options, points_options) = (config.road, closed_form_options(&config.scale));
        Some(match (self, state) {
            (Self::Aligned(_), ScaleState::Aligned(road)) => {
                Self::Aligned(Box::new(RoadTracker::from_state(camera, road_options, *road)))
            }
            (Self::ClosedForm(_), ScaleState::ClosedForm(points)) => {
                Self::ClosedForm(Box::new(ClosedFormScale::from_state(camera, points_options, points)))
            }
            (Self::Both(_), ScaleState::Both(both)) => {
                let (road, points, measurements) = *both;
                let road = RoadTracker::from_state(camera, road_options, road);
                let points = ClosedFormScale::from_state(camera, points_options, points);
                Self::Both(Box::new(RoadAndPoints { road, points, measurements }))
            }
            (Self::Unmeasured, ScaleState::Unmeasured) => Self::Unmeasured,
            _ => return None,
        })
    }

    pub(crate) fn process(
        &mut self,
        input: &RoadInput<'_>,
        trajectory: &OdometryTrajectory,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<RoadMeasurement> {
        let pose_of = |k: usize| trajectory.measured_pose(k);
        match self {
            Self::Aligned(road) => road.process(input, pose_of, usable),
            Self::ClosedForm(scale) => scale.process(input, pose_of, usable),
            Self::Both(both) => both.process(input, pose_of, usable),
            Self::Unmeasured => None,
        }
    }

    /// The road as last followed, in the odometry's unit; m with `mᵀX = 1`.
    pub(crate) fn plane(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Aligned(road) => road.plane(),
            // A level road under a camera that looks along it.
            Self::ClosedForm(scale) => scale.height_units().map(|h| Vector3::y() / h),
            Self::Both(both) => both.road.plane(),
            Self::Unmeasured => None,
        }
    }

    /// The oldest row whose pose the next frame may ask for.
    pub(crate) fn oldest(&self) -> Option<usize> {
        match self {
            Self::Aligned(road) => road.oldest(),
            Self::ClosedForm(scale) => scale.oldest(),
            Self::Both(both) => both.road.oldest().into_iter().chain(both.points.oldest()).min(),
            Self::Unmeasured => None,
        }
    }

    /// Takes out measurements of frames before a row, many at once, but for the newest.
    pub(crate) fn forget_before(&mut self, row: usize) -> Vec<RoadMeasurement> {
        match self {
            Self::Aligned(road) => road.forget_before(row),
            Self::ClosedForm(scale) => scale.forget_before(row),
            Self::Both(both) => both.forget_before(row),
            Self::Unmeasured => Vec::new(),
        }
    }

    /// Puts back the measurements that were taken out.
    pub(crate) fn put_back(&mut self, older: Vec<RoadMeasurement>) {
        match self {
            Self::Aligned(road) => road.put_back(older),
            Self::ClosedForm(scale) => scale.put_back(older),
            Self::Both(both) => drop(both.measurements.splice(..0, older)),
            Self::Unmeasured => {}
        }
    }

    /// Frames in which the road mirrored what stands above it.
    pub(crate) fn mirrored(&self) -> Option<MirroredFrames> {
        match self {
            Self::Aligned(road) => road.mirrored(),
            Self::Both(both) => both.road.mirrored(),
            Self::ClosedForm(_) | Self::Unmeasured => None,
        }
    }

    pub(crate) fn measurements(&self) -> &[RoadMeasurement] {
        match self {
            Self::Aligned(road) => road.measurements(),
            Self::ClosedForm(scale) => scale.measurements(),
            Self::Both(both) => &both.measurements,
            Self::Unmeasured => &[],
        }
    }

    /// Ends the drive: all measurements but those taken out.
    pub(crate) fn finish(self) -> Vec<RoadMeasurement> {
        match self {
            Self::Aligned(road) => road.finish(),
            Self::ClosedForm(scale) => scale.finish(),
            Self::Both(both) => both.measurements,
            Self::Unmeasured => Vec::new(),
        }
    }
}

fn closed_form_options(scale: &ScaleOptions) -> ClosedFormOptions {
    ClosedFormOptions {
        farthest_heights: scale.farthest_m / PAPER_HEIGHT_M,
        average: scale.average,
        advanced: scale.advanced.matching,
    }
}

/// The trajectory in metres; `metric` when the odometry's unit is the metre already.
pub(crate) fn ego(
    odometry: &OdometryTrajectory,
    measurements: &[RoadMeasurement],
    height_m: f64,
    metric: bool,
    config: &Config,
) -> EgoTrajectory {
    if metric {
        EgoTrajectory::metric(odometry, measurements, height_m, 0.0, &config.scale.advanced.metric)
    } else if config.scale.smoothed {
        EgoTrajectory::new(odometry, measurements, height_m, &config.scale.advanced.metric)
    } else {
        EgoTrajectory::unsmoothed(odometry, measurements, height_m, &config.scale.advanced.metric)
    }
}
