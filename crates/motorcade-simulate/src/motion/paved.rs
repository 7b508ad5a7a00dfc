//! Paved ground beside the carriageway.

use nalgebra::{Point2, Vector2};

/// Asphalt within a distance of a line in the coordinates (s, d) of a road: an arm of a junction, a row of parking bays, a yard or, where both ends
/// are one point, a disc. It has the height of the carriageway.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paved {
    /// Ends of the line, (s, d) \[m\].
    pub ends_m: [[f64; 2]; 2],
    /// Distance from the line to the edge \[m\].
    pub half_width_m: f64,
    /// Radius of a planted island round the first end \[m\]; 0 for none.
    pub island_m: f64,
    /// True with a dashed line along the middle.
    pub centre_line: bool,
}

impl Paved {
    /// Distance along the line and to its left \[m\]; of a disc the distance from its centre.
    pub(crate) fn local(&self, s: f64, d: f64) -> (f64, f64) {
        let [from, to] = self.ends_m.map(Point2::from);
        let offset = Point2::new(s, d) - from;
        match (to - from).try_normalize(1e-9) {
            Some(forward) => (offset.dot(&forward), offset.dot(&Vector2::new(-forward.y, forward.x))),
            None => (0.0, offset.norm()),
        }
    }

    /// Length of the line \[m\].
    pub(crate) fn length_m(&self) -> f64 {
        let [from, to] = self.ends_m.map(Point2::from);
        (to - from).norm()
    }

    /// Distance of (s, d) from the edge \[m\], negative inside; islands are inside.
    pub(crate) fn outside_m(&self, s: f64, d: f64) -> f64 {
        let (along, across) = self.local(s, d);
        let beyond = along - along.clamp(0.0, self.length_m());
        beyond.hypot(across) - self.half_width_m
    }

    /// Distance of (s, d) from the edge of the island \[m\], negative on it; `None` without an island.
    pub(crate) fn off_island_m(&self, s: f64, d: f64) -> Option<f64> {
        let [x, y] = self.ends_m[0];
        (self.island_m > 0.0).then(|| (s - x).hypot(d - y) - self.island_m)
    }

    /// First and last `s` \[m\].
    pub(crate) fn extent_m(&self) -> (f64, f64) {
        let [[a, _], [b, _]] = self.ends_m;
        (a.min(b) - self.half_width_m, a.max(b) + self.half_width_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_line_with_round_ends() {
        let bay = Paved {
            ends_m: [[10.0, -8.0], [30.0, -8.0]],
            half_width_m: 3.0,
            island_m: 0.0,
            centre_line: false,
        };
        assert!((bay.outside_m(20.0, -12.0) - 1.0).abs() < 1e-12);
        assert!((bay.outside_m(33.0, -12.0) - 2.0).abs() < 1e-12, "3, 4, 5 less 3");
        assert_eq!(bay.extent_m(), (7.0, 33.0));
        let disc = Paved { ends_m: [[40.0, 0.0]; 2], half_width_m: 17.0, island_m: 9.0, centre_line: false };
        assert!((disc.outside_m(40.0, 20.0) - 3.0).abs() < 1e-12);
        assert_eq!((disc.off_island_m(43.0, 4.0), bay.off_island_m(0.0, 0.0)), (Some(-4.0), None));
    }
}
