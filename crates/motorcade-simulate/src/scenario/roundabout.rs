//! Ways over a roundabout. Traffic goes round to the left.

use nalgebra::{Point2, Vector2};

use crate::motion::Paved;
use crate::route::{LANE_M, join};

/// A roundabout on a straight road, in the road's (s, d).
pub(super) struct Roundabout {
    /// Its centre \[m\].
    pub centre_m: [f64; 2],
    /// Radius of its outer edge \[m\].
    pub outer_m: f64,
    /// Radius of its island \[m\].
    pub island_m: f64,
}

/// Angle round the centre between an arm and the end of the arc onto which its traffic turns \[rad\].
const MERGE_RAD: f64 = 0.62;
/// Way from the outer edge at which traffic begins to turn \[m\].
const APPROACH_M: f64 = 4.0;

impl Roundabout {
    /// Its ground.
    pub(super) fn paved(&self) -> Paved {
        let ends_m = [self.centre_m; 2];
        Paved { ends_m, half_width_m: self.outer_m, island_m: self.island_m, centre_line: false }
    }

    /// From the arm at one angle to that at another \[rad\], from `reach_m` before the outer edge to 100 m behind it.
    pub(super) fn way(&self, from_rad: f64, to_rad: f64, reach_m: f64) -> Vec<[f64; 2]> {
        let centre = Point2::from(self.centre_m);
        let lane_m = 0.5 * (self.outer_m + self.island_m);
        let arm = |angle_rad: f64, out_m: f64, left_m: f64| {
            let (sin, cos) = angle_rad.sin_cos();
            centre + Vector2::new(cos, sin) * out_m + Vector2::new(-sin, cos) * left_m
        };
        let near_m = self.outer_m + APPROACH_M;
        // Traffic to the centre has it on its left, so it is on the other side of its arm than traffic from the centre.
        let mut points = vec![arm(from_rad, near_m + reach_m, LANE_M), arm(from_rad, near_m, LANE_M)];
        let whole = std::f64::consts::TAU;
        let arc_rad = (to_rad - from_rad).rem_euclid(whole) - 2.0 * MERGE_RAD;
        let steps = (arc_rad * lane_m).ceil().max(2.0) as usize;
        let on_arc = |i: usize| {
            let angle = from_rad + MERGE_RAD + arc_rad * i as f64 / steps as f64;
            arm(angle, lane_m, 0.0)
        };
        join(&mut points, (0..=steps).map(on_arc).collect());
        join(&mut points, vec![arm(to_rad, near_m, -LANE_M), arm(to_rad, near_m + 100.0, -LANE_M)]);
        points.into_iter().map(|p| [p.x, p.y]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_to_the_opposite_arm_goes_half_round_on_the_right() {
        let round = Roundabout { centre_m: [40.0, 0.0], outer_m: 18.0, island_m: 9.0 };
        let way = round.way(std::f64::consts::PI, 0.0, 30.0);
        assert!((way[0][0] + 12.0).abs() < 1e-9 && (way[0][1] + LANE_M).abs() < 1e-9, "{:?}", way[0]);
        let last = way[way.len() - 1];
        assert!((last[0] - 162.0).abs() < 1e-9 && (last[1] + LANE_M).abs() < 1e-9, "{last:?}");
        let lowest = way.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        assert!((lowest + 13.5).abs() < 0.1, "{lowest}");
        let off = way.iter().map(|p| (p[0] - 40.0).hypot(p[1])).fold(f64::INFINITY, f64::min);
        assert!(off > 12.5, "{off}");
    }
}
