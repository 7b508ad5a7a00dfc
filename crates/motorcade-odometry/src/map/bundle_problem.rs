//! The problem of the windowed bundle adjustment and its cost.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, robust::RobustKernel};
use nalgebra::{Point2, Point3};

use super::baseline_length::BaselineLength;
use super::options::BundleOptions;
use super::road_point::RoadPoint;

type CameraFromWorld = Pose<Camera, World>;

/// One observation of a point from a pose, by index.
#[derive(Clone, Copy, Debug)]
pub struct KeyframeObservation {
    /// Index of the pose.
    pub pose: usize,
    /// Image of the point \[px\].
    pub pixel: Point2<f64>,
}

/// The problem; solved in place.
#[derive(Clone, Debug, Default)]
pub struct BundleProblem {
    /// `camera_from_world` of every keyframe.
    pub poses: Vec<Pose<Camera, World>>,
    /// True for poses that stay fixed.
    pub fixed: Vec<bool>,
    /// Points in the world.
    pub points: Vec<Point3<f64>>,
    /// KeyframeObservations of each point.
    pub observations: Vec<Vec<KeyframeObservation>>,
    /// Road constraint of each point that has one; may be left empty.
    pub road_points: Vec<Option<RoadPoint>>,
    /// Soft distances between poses.
    pub lengths: Vec<BaselineLength>,
}

impl BundleProblem {
    /// Robust cost \[px²\]; an observation from behind counts as a far outlier.
    pub(super) fn cost(
        &self,
        camera: &PinholeCamera,
        options: &BundleOptions,
        poses: &[CameraFromWorld],
        points: &[Point3<f64>],
    ) -> f64 {
        let kernel = RobustKernel::Cauchy(options.kernel_px);
        let behind_px = options.behind_px;
        let one = |point: &Point3<f64>, s: &KeyframeObservation| {
            let projected = camera.project(&poses[s.pose].transform_point(point));
            kernel.cost(projected.map_or(behind_px * behind_px, |p| (p - s.pixel).norm_squared()))
        };
        let all = points.iter().zip(&self.observations);
        let reprojections: f64 =
            all.map(|(point, observations)| observations.iter().map(|s| one(point, s)).sum::<f64>()).sum();
        let constrained = points.iter().zip(&self.road_points);
        let road_points =
            constrained.filter_map(|(point, o)| o.map(|o| o.cost(&poses[o.pose], point, options)));
        reprojections
            + road_points.sum::<f64>()
            + self.lengths.iter().map(|l| l.cost(poses, options)).sum::<f64>()
    }
}
