//! A scene point tracked through the images.

use nalgebra::{Point2, Point3};

/// A scene point with its observations.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Landmark {
    /// Number of the corner, counted over the whole drive.
    pub id: u64,
    /// Position in the segment's world; `None` until it is triangulated.
    pub point_in_world: Option<Point3<f64>>,
    /// Image in the last tracked frame \[px\]; `None` once tracking lost it.
    pub pixel: Option<Point2<f64>>,
    /// Image in the frame that the templates of tracking are taken from \[px\].
    pub template_pixel: Option<Point2<f64>>,
    /// Image when the standstill test last took its reference \[px\].
    pub standstill_pixel: Option<Point2<f64>>,
    /// Observations from keyframes: keyframe number and pixel, oldest first.
    pub observations: Vec<(usize, Point2<f64>)>,
    /// Time for which it has been an outlier of the camera pose without interruption \[ns\].
    pub outlier_ns: i64,
    /// The object it belongs to.
    pub carrier: Carrier,
}

/// The object a landmark belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Carrier {
    /// The static scene.
    Scene,
    /// A vehicle that moves, or that has not been classified for long enough.
    MovingVehicle {
        /// Time for which it has been classified as static without interruption \[ns\].
        static_ns: i64,
    },
    /// A vehicle classified as static.
    StaticVehicle,
}

impl Landmark {
    /// Corner `id`, just detected in keyframe `keyframe`, on the scene.
    pub fn new(id: u64, pixel: Point2<f64>, keyframe: usize) -> Self {
        Self {
            id,
            point_in_world: None,
            pixel: Some(pixel),
            template_pixel: Some(pixel),
            standstill_pixel: None,
            observations: vec![(keyframe, pixel)],
            outlier_ns: 0,
            carrier: Carrier::Scene,
        }
    }

    /// True when it may locate the camera: scene, or a static vehicle.
    pub fn is_static(&self) -> bool {
        !matches!(self.carrier, Carrier::MovingVehicle { .. })
    }

    /// True on a vehicle, static or not.
    pub fn is_on_vehicle(&self) -> bool {
        self.carrier != Carrier::Scene
    }
}
