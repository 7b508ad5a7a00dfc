//! Keyframes as places.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Point3;

use crate::features::Feature;

/// Features of a keyframe, with positions where they are known.
#[derive(Clone, Debug)]
pub struct PlaceKeyframe {
    /// Frame of the drive.
    pub frame: usize,
    /// Map it belongs to: poses of different maps have nothing to do with each other.
    pub segment: usize,
    /// Features.
    pub features: Vec<Feature>,
}

/// A keyframe with its pose, ready to be searched.
#[derive(Clone, Debug)]
pub struct PlacedKeyframe {
    /// Frame of the drive.
    pub frame: usize,
    /// Map it belongs to.
    pub segment: usize,
    /// Pose \[m\].
    pub world_from_camera: Pose<World, Camera>,
    /// Way driven from the beginning of the drive \[m\].
    pub way_m: f64,
    /// Features.
    pub features: Vec<Feature>,
    /// Features with positions.
    pub landmarks: Vec<Landmark>,
}

/// A feature with a position. 20 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmark {
    /// Index of the feature.
    pub feature: u32,
    /// Position in the keyframe's camera \[m\].
    pub point_in_camera: [f32; 3],
    /// Standard deviation of its depth along the ray, as a share of the depth.
    pub depth_sigma: f32,
}

impl Landmark {
    /// Position in the keyframe's camera \[m\].
    pub fn point(&self) -> Point3<f64> {
        let [x, y, z] = self.point_in_camera.map(f64::from);
        Point3::new(x, y, z)
    }
}
