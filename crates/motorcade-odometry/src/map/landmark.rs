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
    /// On a vehicle: how often in a row it was found to stand. `None` on the scene.
    pub on_vehicle: Option<u8>,
}

/// Judgements in a row after which a vehicle is believed to stand: three frames.
const BELIEVED: u8 = 3;

impl Landmark {
    /// A corner just detected in keyframe `keyframe`.
    pub fn new(pixel: Point2<f64>, keyframe: usize) -> Self {
        Self {
            point_in_world: None,
            pixel: Some(pixel),
            sightings: vec![(keyframe, pixel)],
            strikes: 0,
            on_vehicle: None,
        }
    }

    /// True when it may locate the camera: scene, or a vehicle that stands.
    pub fn is_static(&self) -> bool {
        self.on_vehicle.is_none_or(|judgements| judgements >= BELIEVED)
    }
}
