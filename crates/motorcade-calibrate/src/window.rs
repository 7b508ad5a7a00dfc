//! A stretch of keyframes that is adjusted together.

use motorcade_geometry::{Camera, Pose, World, robust::RobustKernel, triangulate_rays};
use nalgebra::{DVector, Point2, Point3, Vector3};

use crate::lens::Lens;
use crate::tracks::{MapTracks, Track};

/// Keyframes and corners. A corner is a direction in the keyframe that saw it first and an inverse depth, so that it may be infinitely far.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Window {
    /// `camera_from_world` of the keyframes; the first is held.
    pub poses: Vec<Pose<Camera, World>>,
    pub corners: Vec<Corner>,
    /// Distance of the last keyframe from the first, which is held: the unit of length.
    pub length: f64,
}

/// A corner and its observations.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Corner {
    /// x and y of the direction (x, y, 1) in the anchor, and 1 / depth along its axis; never negative.
    pub place: Vector3<f64>,
    /// Keyframe and pixel, the anchor first.
    pub observations: Track,
}

impl Corner {
    /// The corner times its inverse depth, in keyframe `view`.
    pub fn in_view(&self, poses: &[Pose<Camera, World>], view: usize) -> Vector3<f64> {
        let (anchor, rho) = (&poses[self.anchor()], self.place.z);
        let direction = Vector3::new(self.place.x, self.place.y, 1.0);
        if view == self.anchor() {
            return direction;
        }
        let in_world = anchor.rotation_matrix().transpose() * (direction - rho * anchor.translation());
        poses[view].rotation_matrix() * in_world + rho * poses[view].translation()
    }

    pub fn anchor(&self) -> usize {
        self.observations[0].0
    }
}

impl Window {
    /// Keyframes `range` of a map with the corners that at least three of them see, `least_corners` or more; places by `lens`.
    pub fn new(
        map: &MapTracks,
        range: std::ops::Range<usize>,
        lens: &Lens,
        least_corners: usize,
    ) -> Option<Self> {
        let poses = map.poses[range.clone()].to_vec();
        let (first, last) = (poses.first()?.inverse(), poses.last()?.inverse());
        let length = (last.translation() - first.translation()).norm();
        let within = |track: &Track| {
            let inside = track.iter().filter(|(n, _)| range.contains(n));
            let observations: Vec<_> = inside.map(|(n, p)| (n - range.start, *p)).collect();
            (observations.len() >= 3)
                .then(|| Corner { place: place(&poses, &observations, lens), observations })
        };
        let corners: Vec<Corner> = map.tracks.iter().filter_map(within).collect();
        (length > 0.0 && corners.len() >= least_corners).then_some(Self { poses, corners, length })
    }

    /// Angle that the camera turns through \[rad\].
    pub fn turn_rad(&self) -> f64 {
        self.poses.windows(2).map(|p| (p[1].rotation() * p[0].rotation().inverse()).angle()).sum()
    }

    /// Robust cost \[px²\].
    pub fn cost(&self, lens: &Lens, kernel: RobustKernel, behind_px: f64) -> f64 {
        self.squared_errors(lens, behind_px).map(|e| kernel.cost(e)).sum()
    }

    /// Squared reprojection errors \[px²\]; a corner that is not in front of the camera has the error `behind_px`.
    pub fn squared_errors<'a>(&'a self, lens: &'a Lens, behind_px: f64) -> impl Iterator<Item = f64> + 'a {
        self.corners.iter().flat_map(move |corner| {
            corner.observations.iter().map(move |(view, pixel)| {
                let projected = lens.project(&corner.in_view(&self.poses, *view));
                projected.map_or(behind_px * behind_px, |p| (p.pixel - pixel).norm_squared())
            })
        })
    }

    /// After a step: six numbers for each keyframe but the first, three for each corner.
    pub fn moved(&self, pose_steps: &DVector<f64>, corner_steps: &[Vector3<f64>]) -> Self {
        let pose = |(k, pose): (usize, &Pose<Camera, World>)| match k.checked_sub(1) {
            Some(slot) => pose.retract(&pose_steps.fixed_rows::<6>(6 * slot).into_owned()),
            None => *pose,
        };
        let corner = |(corner, step): (&Corner, &Vector3<f64>)| {
            let mut place = corner.place + step;
            place.z = place.z.max(0.0);
            Corner { place, observations: corner.observations.clone() }
        };
        Self {
            poses: self.poses.iter().enumerate().map(pose).collect(),
            corners: self.corners.iter().zip(corner_steps).map(corner).collect(),
            length: self.length,
        }
    }
}

/// Direction in the first view and inverse depth; zero where the rays do not meet in front.
fn place(poses: &[Pose<Camera, World>], observations: &[(usize, Point2<f64>)], lens: &Lens) -> Vector3<f64> {
    let (anchor, pixel) = &observations[0];
    let ray = |(view, pixel): &(usize, Point2<f64>)| {
        let world_from_camera = poses[*view].inverse();
        let direction = world_from_camera.transform_vector(&lens.ray(pixel)).normalize();
        (Point3::from(world_from_camera.translation()), direction)
    };
    let rays: Vec<_> = observations.iter().map(ray).collect();
    let depth = triangulate_rays(&rays).map(|p| poses[*anchor].transform_point(&p).z).filter(|z| *z > 1e-3);
    let direction = lens.ray(pixel);
    Vector3::new(direction.x, direction.y, depth.map_or(0.0, |z| 1.0 / z))
}
