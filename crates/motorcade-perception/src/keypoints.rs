//! The 2D keypoints of a vehicle in one frame.

use motorcade_shape::{HeadingEvidence, Layout, ObservedKeypoint};

use crate::detection::BoundingBox;

/// Keypoints of a vehicle in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleKeypoints {
    /// Meaning of the points by index.
    pub layout: Layout,
    /// One a keypoint of the layout; confidence 0 where it was not found.
    pub points: Vec<ObservedKeypoint>,
    /// Box of the vehicle they belong to, or the box around the points when that is not known \[px\].
    pub bbox: BoundingBox,
    /// The heading, where the detector estimates it beside the points.
    pub heading: Option<HeadingEvidence>,
    /// Log odds that the box shows a vehicle at all, where the detector estimates them.
    pub presence: Option<f64>,
}

impl VehicleKeypoints {
    /// Confidence from which a point counts as found.
    pub const FOUND: f64 = 0.3;

    /// True when any point was found, however uncertain: of a lorry, the network gives the presence alone.
    pub fn any_found(&self) -> bool {
        self.points.iter().any(|p| p.confidence > 0.0)
    }

    /// Keypoints whose box is the one around the points found; `None` for fewer than three.
    pub fn around_points(layout: Layout, points: Vec<ObservedKeypoint>) -> Option<Self> {
        let found: Vec<&ObservedKeypoint> = points.iter().filter(|p| p.confidence >= Self::FOUND).collect();
        let reach = |start: f64, f: fn(f64, f64) -> f64, axis: usize| {
            found.iter().map(|p| p.pixel[axis]).fold(start, f)
        };
        if found.len() < 3 {
            return None;
        }
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        let bbox = BoundingBox::new([
            reach(low, f64::min, 0),
            reach(low, f64::min, 1),
            reach(high, f64::max, 0),
            reach(high, f64::max, 1),
        ]);
        Some(Self { layout, points, bbox, heading: None, presence: None })
    }
}
