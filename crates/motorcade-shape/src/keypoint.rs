//! Named points on a vehicle and what a shape prior knows of each.

use nalgebra::Vector3;

/// Which orders of keypoints are built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// 36 keypoints, 18 on each side: 0–17 left, 18–35 right, `i` and `i + 18` mirror each other.
    ///
    /// 0 rear, 1 front wheel centre · 2–5 front, 6–9 rear wheel arch (each: front low, front high, rear high, rear low) ·
    /// 10 rear bumper low corner · 11 boot lid corner at the tail light · 12 rear window base · 13 roof rear corner ·
    /// 14 roof front corner · 15 windscreen base · 16 bonnet front corner at the headlight · 17 front bumper low corner.
    Car36,
    /// 14 keypoints, left and right in turn: 0 1 front, 2 3 rear wheel centres · 4 5 headlights · 6 7 tail lights ·
    /// 8 9 mirrors · 10 11 roof front, 12 13 roof rear corners.
    Car14,
}

impl Layout {
    /// Number of keypoints.
    pub fn count(self) -> usize {
        match self {
            Self::Car36 => 36,
            Self::Car14 => 14,
        }
    }
    /// Place of the left-side point `side` and of its mirror image.
    pub(crate) fn pair(self, side: usize) -> (usize, usize) {
        match self {
            Self::Car36 => (side, side + 18),
            Self::Car14 => (2 * side, 2 * side + 1),
        }
    }
}

/// One keypoint of a prior.
#[derive(Clone, Debug, PartialEq)]
pub struct Keypoint {
    /// What it is, with its side.
    pub name: String,
    /// The keypoint it turns into when the vehicle is mirrored left to right; itself when it lies in the middle.
    pub mirror: usize,
    /// Unit outward directions (vehicle frame) of the faces it lies on. It shows itself to a camera that one of them
    /// faces; with none, nothing is known of when it shows.
    pub faces: Vec<Vector3<f64>>,
}

/// A direction or point on the other side of the vehicle.
pub(crate) fn mirrored(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, -v.y, v.z)
}
