//! Named keypoints of a vehicle.

use nalgebra::Vector3;

/// Built-in orders of keypoints.
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
    pub const fn count(self) -> usize {
        match self {
            Self::Car36 => 36,
            Self::Car14 => 14,
        }
    }
    /// Indices of the left-side point `side` and of its mirror image.
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
    /// Name, with its side.
    pub name: String,
    /// Index of its mirror image; its own on the plane of symmetry.
    pub mirror: usize,
    /// Unit outward normals (vehicle frame) of the faces it lies on: it is visible when one of them is turned to the camera. Empty
    /// when its visibility is unknown.
    pub faces: Vec<Vector3<f64>>,
}

/// Mirror image of a direction or point.
pub(crate) fn mirrored(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, -v.y, v.z)
}
