//! The cuboid of a vehicle: corners, edges, and which of them its body hides.

use motorcade_geometry::{Camera, Pose, Vehicle};
use nalgebra::Point3;

/// Corners: bottom front left, front right, rear right, rear left, then the same at the top.
const CORNERS: [(f64, f64, f64); 8] = [
    (0.5, 0.5, 0.0),
    (0.5, -0.5, 0.0),
    (-0.5, -0.5, 0.0),
    (-0.5, 0.5, 0.0),
    (0.5, 0.5, 1.0),
    (0.5, -0.5, 1.0),
    (-0.5, -0.5, 1.0),
    (-0.5, 0.5, 1.0),
];

/// Edges as two corners each, with the two faces they belong to.
const EDGES: [([usize; 2], [usize; 2]); 12] = [
    ([0, 1], [FRONT, BOTTOM]),
    ([1, 2], [RIGHT, BOTTOM]),
    ([2, 3], [REAR, BOTTOM]),
    ([3, 0], [LEFT, BOTTOM]),
    ([4, 5], [FRONT, TOP]),
    ([5, 6], [RIGHT, TOP]),
    ([6, 7], [REAR, TOP]),
    ([7, 4], [LEFT, TOP]),
    ([0, 4], [FRONT, LEFT]),
    ([1, 5], [FRONT, RIGHT]),
    ([2, 6], [REAR, RIGHT]),
    ([3, 7], [REAR, LEFT]),
];

const FRONT: usize = 0;
const REAR: usize = 1;
const LEFT: usize = 2;
const RIGHT: usize = 3;
const TOP: usize = 4;
const BOTTOM: usize = 5;

/// A cuboid in the camera \[m\].
pub(crate) struct Cuboid {
    corners: [Point3<f64>; 8],
    /// Faces that the camera is in front of.
    seen: [bool; 6],
}

impl Cuboid {
    /// Size: length, width and height \[m\].
    pub(crate) fn new(camera_from_vehicle: &Pose<Camera, Vehicle>, size_m: [f64; 3]) -> Self {
        let [length, width, height] = size_m;
        let place =
            |(x, y, z)| camera_from_vehicle.transform_point(&Point3::new(x * length, y * width, z * height));
        let camera = camera_from_vehicle.inverse().translation();
        let (x, y, z) = (camera.x, camera.y, camera.z);
        let (l, w) = (0.5 * length, 0.5 * width);
        Self { corners: CORNERS.map(place), seen: [x > l, x < -l, y > w, y < -w, z > height, z < 0.0] }
    }

    /// True when the camera lies inside: nothing of it can be drawn.
    pub(crate) fn holds_camera(&self) -> bool {
        !self.seen.contains(&true)
    }

    /// Edges that are seen, or those that the body hides.
    pub(crate) fn edges(&self, seen: bool) -> impl Iterator<Item = [Point3<f64>; 2]> + '_ {
        let wanted = move |faces: &[usize; 2]| faces.iter().any(|face| self.seen[*face]) == seen;
        EDGES
            .iter()
            .filter(move |(_, faces)| wanted(faces))
            .map(|(ends, _)| ends.map(|corner| self.corners[corner]))
    }

    /// Corners of the front face in order.
    pub(crate) fn front(&self) -> [Point3<f64>; 4] {
        [0, 1, 5, 4].map(|corner| self.corners[corner])
    }

    /// True when the front face is turned towards the camera.
    pub(crate) fn front_is_seen(&self) -> bool {
        self.seen[FRONT]
    }

    /// Corners of the six faces.
    pub(crate) fn faces(&self) -> [[Point3<f64>; 4]; 6] {
        [[0, 1, 5, 4], [2, 3, 7, 6], [3, 0, 4, 7], [1, 2, 6, 5], [4, 5, 6, 7], [0, 1, 2, 3]]
            .map(|face| face.map(|corner| self.corners[corner]))
    }

    /// Centre of the bottom, and middle of its front edge.
    pub(crate) fn nose(&self) -> [Point3<f64>; 2] {
        let middle = |a: usize, b: usize| nalgebra::center(&self.corners[a], &self.corners[b]);
        [middle(0, 2), middle(0, 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneVehicle;
    use crate::scene::tests::car;

    fn of(vehicle: &SceneVehicle) -> Cuboid {
        Cuboid::new(&vehicle.camera_from_vehicle, vehicle.size_m)
    }

    #[test]
    fn a_car_straight_ahead_shows_its_rear() {
        // 1.5 m below the camera, 20 m ahead, driving away.
        let cuboid = of(&car(0.0, 20.0));
        assert!(!cuboid.front_is_seen());
        let rear: Vec<_> = cuboid.edges(true).flatten().collect();
        assert_eq!(rear.len(), 8, "the rear alone: the camera is below its top");
        for p in rear {
            assert!((p.z - 18.0).abs() < 1e-9 && (p.x.abs() - 0.9).abs() < 1e-9, "{p}");
            assert!((p.y - 1.5).abs() < 1e-9 || (p.y + 0.1).abs() < 1e-9, "{p}");
        }
        assert_eq!(cuboid.edges(false).count(), 8);
    }

    #[test]
    fn the_camera_inside_is_noticed() {
        assert!(of(&car(0.0, 0.5)).holds_camera());
        assert!(!of(&car(0.0, 3.0)).holds_camera());
    }
}
