//! Source of the camera's motion: the odometry, or a trajectory file.

use std::ops::Range;
use std::sync::Arc;

use image::GrayImage;
use motorcade_geometry::{BoundingBox, Camera, Pose, World};
use motorcade_odometry::{Odometry, OdometryTrajectory, Pyramid, RoadMeasurement, StaticMask};
use nalgebra::Vector3;

/// A camera trajectory from elsewhere, one pose a frame of the run.
#[derive(Clone, Debug)]
pub struct ExternalTrajectory {
    /// `world_from_camera` of each frame.
    pub world_from_camera: Vec<Pose<World, Camera>>,
    /// True when its lengths are metres; else the road gives the scale, or vehicles that stand.
    pub metric: bool,
}

impl ExternalTrajectory {
    /// The frames of a range as an odometry in metres, for a unit of so many.
    pub(crate) fn in_metres(&self, unit_m: f64, range: Range<usize>) -> OdometryTrajectory {
        let poses = self.world_from_camera.get(range).unwrap_or_default().iter().map(|p| p.scaled(unit_m));
        Self { world_from_camera: poses.collect(), metric: true }.as_odometry()
    }

    /// As an odometry. One of unknown scale gets a unit near a metre, which the road search starts from.
    pub(crate) fn as_odometry(&self) -> OdometryTrajectory {
        let poses = &self.world_from_camera;
        let first = poses.first().map(Pose::inverse).unwrap_or_default();
        let relative: Vec<Pose<World, Camera>> =
            poses.iter().map(|p| first.cast::<World, World>() * *p).collect();
        if self.metric {
            return OdometryTrajectory::from_poses(&relative);
        }
        let mut steps: Vec<f64> =
            relative.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm()).collect();
        steps.sort_by(f64::total_cmp);
        // The upper quartile: a drive that mostly stands still moves in some frames.
        let typical = steps.get(steps.len() * 3 / 4).copied().filter(|s| *s > 0.0).unwrap_or(1.0);
        let scaled: Vec<_> = relative.iter().map(|p| p.scaled(1.0 / typical)).collect();
        OdometryTrajectory::from_poses(&scaled)
    }
}

/// Source of the camera's motion.
pub(crate) enum MotionSource {
    Own(Box<Odometry>),
    External(OdometryTrajectory),
}

/// Levels of the pyramids the road is aligned on.
const PYRAMID_LEVELS: usize = 4;

impl MotionSource {
    pub(crate) fn process(&mut self, image: &GrayImage, mask: &StaticMask<'_>) -> Arc<Pyramid> {
        match self {
            Self::Own(odometry) => odometry.process(image, mask),
            Self::External(_) => Arc::new(Pyramid::new(image, PYRAMID_LEVELS)),
        }
    }
    pub(crate) fn skip(&mut self) {
        if let Self::Own(odometry) = self {
            odometry.skip();
        }
    }
    pub(crate) fn constrain_scale(&mut self, measured: &RoadMeasurement) {
        if let Self::Own(odometry) = self {
            odometry.constrain_scale(measured);
        }
    }
    pub(crate) fn classify_static_vehicles(&mut self, boxes: &[BoundingBox], plane: &Vector3<f64>) {
        if let Self::Own(odometry) = self {
            odometry.classify_static_vehicles(boxes, plane);
        }
    }
    pub(crate) fn trajectory(&self) -> &OdometryTrajectory {
        match self {
            Self::Own(odometry) => odometry.so_far(),
            Self::External(whole) => whole,
        }
    }
    /// All frames' motion; of an external trajectory the first `frames`, as many as were read.
    pub(crate) fn finish(self, frames: usize) -> OdometryTrajectory {
        match self {
            Self::Own(odometry) => odometry.finish(),
            Self::External(mut whole) => {
                whole.frames.truncate(frames);
                whole
            }
        }
    }
}
