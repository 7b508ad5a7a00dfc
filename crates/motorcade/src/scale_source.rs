//! Source of metric scale: the aligned road, or the paper's closed form.

use motorcade_geometry::PinholeCamera;
use motorcade_odometry::{
    ClosedFormOptions, ClosedFormScale, EgoTrajectory, OdometryTrajectory, RoadInput, RoadMeasurement,
    RoadTracker,
};
use nalgebra::{Point2, Vector3};

use crate::config::Config;

/// The height that T of the paper is given for \[m\]: KITTI's.
const PAPER_HEIGHT_M: f64 = 1.65;

/// One of the two ways to measure scale on the road.
pub(crate) enum ScaleSource {
    Aligned(Box<RoadTracker>),
    ClosedForm(Box<ClosedFormScale>),
}

impl ScaleSource {
    pub(crate) fn new(camera: PinholeCamera, config: &Config) -> Self {
        if config.scale.closed_form {
            Self::ClosedForm(Box::new(ClosedFormScale::new(
                camera,
                ClosedFormOptions {
                    farthest_heights: config.scale.farthest_m / PAPER_HEIGHT_M,
                    average: config.scale.average,
                    advanced: config.scale.matching,
                },
            )))
        } else {
            Self::Aligned(Box::new(RoadTracker::new(camera, config.road)))
        }
    }

    pub(crate) fn process(
        &mut self,
        input: &RoadInput<'_>,
        trajectory: &OdometryTrajectory,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<RoadMeasurement> {
        let pose_of = |k: usize| trajectory.camera_from_world(k);
        match self {
            Self::Aligned(road) => road.process(input, pose_of, usable),
            Self::ClosedForm(scale) => scale.process(input, pose_of, usable),
        }
    }

    /// The road as last followed, in the odometry's unit; m with `mᵀX = 1`.
    pub(crate) fn plane(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Aligned(road) => road.plane(),
            // A level road under a camera that looks along it.
            Self::ClosedForm(scale) => scale.height_units().map(|h| Vector3::y() / h),
        }
    }

    /// Forgets measurements of frames before a row, but for the newest; returns their number.
    pub(crate) fn forget_before(&mut self, row: usize) -> usize {
        match self {
            Self::Aligned(road) => road.forget_before(row),
            Self::ClosedForm(scale) => scale.forget_before(row),
        }
    }

    pub(crate) fn measurements(&self) -> &[RoadMeasurement] {
        match self {
            Self::Aligned(road) => road.measurements(),
            Self::ClosedForm(scale) => scale.measurements(),
        }
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
        EgoTrajectory::metric(odometry, measurements, height_m, 0.0, &config.scale.advanced)
    } else if config.scale.smoothed {
        EgoTrajectory::new(odometry, measurements, height_m, &config.scale.advanced)
    } else {
        EgoTrajectory::unsmoothed(odometry, measurements, height_m, &config.scale.advanced)
    }
}
