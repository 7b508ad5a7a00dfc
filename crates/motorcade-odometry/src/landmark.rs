//! A scene point followed through the images.

use nalgebra::{Point2, Point3};

/// A scene point: where it was seen from keyframes, where it is now, and, once two views disagree enough, its position.
#[derive(Clone, Debug)]
pub struct Landmark {
    /// Position in the segment's world; `None` until it is triangulated.
    pub point_in_world: Option<Point3<f64>>,
    /// Image in the last tracked frame \[px\]; `None` once tracking lost it.
    pub pixel: Option<Point2<f64>>,
    /// Sightings from keyframes: keyframe number and pixel, oldest first.
    pub sightings: Vec<(usize, Point2<f64>)>,
    /// Frames in a row in which the camera pose found it an outlier.
    pub strikes: u8,
}

impl Landmark {
    /// A corner just detected in keyframe `keyframe`.
    pub fn new(pixel: Point2<f64>, keyframe: usize) -> Self {
        Self { point_in_world: None, pixel: Some(pixel), sightings: vec![(keyframe, pixel)], strikes: 0 }
    }
}
