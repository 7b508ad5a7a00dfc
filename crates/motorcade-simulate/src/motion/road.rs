//! The road: a centre line with bends and slopes. `s` runs along it, `d` across it, positive to the left.

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::Paved;
use super::polyline::rounded;

/// A section of constant curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Length \[m\].
    pub length_m: f64,
    /// Curvature \[1/m\], positive to the left.
    pub curvature_per_m: f64,
}

/// A section of constant slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grade {
    /// Length \[m\].
    pub length_m: f64,
    /// Rise over run.
    pub rise: f64,
}

/// Markings and surroundings of a road.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RoadKind {
    /// One lane each way, kerbs, pavements and houses.
    #[default]
    Street,
    /// Three lanes each way with a planted median between them, hard shoulders, trees and hedges.
    Motorway,
}

/// Plan of a road. Before and after it the road is straight and level, or it is closed.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadPlan {
    /// Distance from the centre line to the kerb \[m\].
    pub half_width_m: f64,
    /// Bends, from s = 0 on.
    pub bends: Vec<Bend>,
    /// Slopes, from s = 0 on.
    pub grades: Vec<Grade>,
    /// Positions `s` of crossings at right angles \[m\].
    pub crossings_m: Vec<f64>,
    /// True where the end of the bends is their beginning: the road is driven round. It is level then.
    pub closed: bool,
    /// Corners of the way through a town \[m\], in place of bends and grades; none for other roads. Where two corners follow each other that did
    /// before, the same street is driven again.
    pub corners_m: Vec<[f64; 2]>,
    /// Paved ground beside the carriageway.
    pub paved: Vec<Paved>,
    /// Markings and surroundings.
    pub kind: RoadKind,
}

/// A point of the centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadPoint {
    /// Position in the site \[m\].
    pub position: Point3<f64>,
    /// Direction of travel \[rad\], from site x towards site y.
    pub heading_rad: f64,
    /// Curvature \[1/m\], positive to the left.
    pub curvature_per_m: f64,
    /// Rise over run.
    pub rise: f64,
}

/// A road as built, sampled every metre.
#[derive(Clone, Debug)]
pub struct Road {
    /// Distance from the centre line to the kerb \[m\].
    pub half_width_m: f64,
    /// Positions `s` of crossings \[m\].
    pub crossings_m: Vec<f64>,
    /// Paved ground beside the carriageway.
    pub(crate) paved: Vec<Paved>,
    /// Markings and surroundings.
    pub(crate) kind: RoadKind,
    start_m: f64,
    samples: Vec<RoadPoint>,
    /// `s` of the first and the last point that is driven \[m\], where the road is closed.
    rounds_m: Option<(f64, f64)>,
    /// True for samples on a street that was driven before; empty where none is.
    again: Vec<bool>,
}

/// Half width of a crossing road \[m\].
pub(crate) const CROSSING_HALF_WIDTH_M: f64 = 3.6;
/// Distance between samples \[m\].
const STEP_M: f64 = 1.0;
/// Way from a corner at which its rounding begins \[m\].
const CORNER_M: f64 = 22.0;
/// Samples between two visits of a street at least.
const APART: usize = 60;
/// Length over which curvature and slope change \[m\]: steering and suspension are not instantaneous.
const TRANSITION_M: f64 = 14.0;

impl Road {
    /// Builds a plan from `start_m` to `end_m`.
    pub fn build(plan: &RoadPlan, start_m: f64, end_m: f64) -> Self {
        if plan.closed {
            return Self::closed(plan, (start_m, end_m));
        }
        if !plan.corners_m.is_empty() {
            return Self::through_town(plan, start_m);
        }
        let count = ((end_m - start_m) / STEP_M).ceil().max(2.0) as usize + 1;
        let sample = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..count).map(|i| averaged(f, start_m + i as f64 * STEP_M)).collect()
        };
        let curvatures = sample(&|s| stretch(plan.bends.iter().map(|b| (b.length_m, b.curvature_per_m)), s));
        let rises = sample(&|s| stretch(plan.grades.iter().map(|g| (g.length_m, g.rise)), s));
        let mut samples = Vec::with_capacity(count);
        let (mut position, mut heading_rad) = (Point3::new(start_m, 0.0, 0.0), 0.0_f64);
        for (i, (&curvature_per_m, &rise)) in curvatures.iter().zip(&rises).enumerate() {
            samples.push(RoadPoint { position, heading_rad, curvature_per_m, rise });
            let next = |v: &[f64]| v.get(i + 1).copied().unwrap_or_default();
            let turn = 0.5 * (curvature_per_m + next(&curvatures)) * STEP_M;
            let middle = heading_rad + 0.5 * turn;
            position += Vector3::new(middle.cos(), middle.sin(), 0.5 * (rise + next(&rises))) * STEP_M;
            heading_rad += turn;
        }
        Self {
            half_width_m: plan.half_width_m,
            crossings_m: plan.crossings_m.clone(),
            paved: plan.paved.clone(),
            kind: plan.kind,
            start_m,
            samples,
            rounds_m: None,
            again: Vec::new(),
        }
    }

    /// A road along the corners of a plan, of which the first is `s = 0`; it is level.
    fn through_town(plan: &RoadPlan, start_m: f64) -> Self {
        let mut corners: Vec<Point2<f64>> = plan.corners_m.iter().map(|c| Point2::from(*c)).collect();
        if let [first, second, ..] = corners[..] {
            corners[0] = first + (second - first).normalize() * start_m;
        }
        let road = Self::through(&rounded(&corners, CORNER_M), plan.half_width_m);
        let again = again(&road.samples);
        Self { start_m, again, paved: plan.paved.clone(), kind: plan.kind, ..road }
    }

    /// True where the street at `s` was driven before, at a smaller `s`.
    pub(crate) fn is_again(&self, s: f64) -> bool {
        let sample = ((s - self.start_m) / STEP_M).max(0.0) as usize;
        self.again.get(sample).copied().unwrap_or(false)
    }

    /// True of a way through a town, on which some streets may be driven again.
    pub(crate) fn drives_again(&self) -> bool {
        !self.again.is_empty()
    }

    /// True where stretches of the road lie beside or on each other.
    pub(crate) fn meets_itself(&self) -> bool {
        self.rounds_m.is_some() || self.drives_again()
    }

    /// A closed road, driven from `rounds_m.0` to `rounds_m.1`. What the bends leave open is shared by all samples.
    fn closed(plan: &RoadPlan, rounds_m: (f64, f64)) -> Self {
        let length_m = plan.bends.iter().map(|b| b.length_m).sum::<f64>().max(2.0 * STEP_M);
        let count = (length_m / STEP_M).round() as usize;
        let curvature = |s: f64| {
            stretch(plan.bends.iter().map(|b| (b.length_m, b.curvature_per_m)), s.rem_euclid(length_m))
        };
        let curvatures: Vec<f64> = (0..=count).map(|i| averaged(&curvature, i as f64 * STEP_M)).collect();
        let turns = |i: usize| 0.5 * (curvatures[i] + curvatures[i + 1]) * STEP_M;
        let turned: f64 = (0..count).map(turns).sum();
        let whole = (turned / std::f64::consts::TAU).round() * std::f64::consts::TAU;
        let missing = (whole - turned) / count as f64;
        let (mut position, mut heading_rad) = (Point3::origin(), 0.0_f64);
        let mut samples = Vec::with_capacity(count + 1);
        for (i, &curvature_per_m) in curvatures.iter().enumerate() {
            samples.push(RoadPoint { position, heading_rad, curvature_per_m, rise: 0.0 });
            if i < count {
                let turn = turns(i) + missing;
                let middle = heading_rad + 0.5 * turn;
                position += Vector3::new(middle.cos(), middle.sin(), 0.0) * STEP_M;
                heading_rad += turn;
            }
        }
        let gap = position - Point3::origin();
        for (i, sample) in samples.iter_mut().enumerate() {
            sample.position -= gap * (i as f64 / count as f64);
        }
        let crossings_m = plan.crossings_m.clone();
        Self {
            half_width_m: plan.half_width_m,
            crossings_m,
            paved: plan.paved.clone(),
            kind: plan.kind,
            start_m: 0.0,
            samples,
            rounds_m: Some(rounds_m),
            again: Vec::new(),
        }
    }

    /// Length of one round \[m\]; `None` of a road that is not closed.
    pub fn round_m(&self) -> Option<f64> {
        self.rounds_m.map(|_| (self.samples.len() - 1) as f64 * STEP_M)
    }

    /// First and last `s` that is driven \[m\]: of a closed road several rounds.
    pub(crate) fn driven_m(&self) -> (f64, f64) {
        self.rounds_m.unwrap_or_else(|| self.extent_m())
    }

    /// A road through points a metre apart, its `s` counted from the first; for roads taken from real drives.
    pub fn through(points: &[Point3<f64>], half_width_m: f64) -> Self {
        let n = points.len();
        let at = |i: usize| points[i.min(n - 1)];
        let direction = |i: usize| at(i + 1) - at(i.saturating_sub(1));
        let heading = |i: usize| direction(i).y.atan2(direction(i).x);
        let mut samples: Vec<RoadPoint> = Vec::with_capacity(n);
        for i in 0..n {
            let v = direction(i);
            let previous = samples.last().map_or(heading(0), |p| p.heading_rad);
            // Headings are unwrapped, so that they can be interpolated.
            let heading_rad = previous + wrapped(heading(i) - previous);
            let curvature_per_m = wrapped(heading(i + 1) - heading(i.saturating_sub(1))) / (2.0 * STEP_M);
            let rise = v.z / v.xy().norm().max(1e-6);
            samples.push(RoadPoint { position: points[i], heading_rad, curvature_per_m, rise });
        }
        Self {
            half_width_m,
            crossings_m: Vec::new(),
            paved: Vec::new(),
            kind: RoadKind::default(),
            start_m: 0.0,
            samples,
            rounds_m: None,
            again: Vec::new(),
        }
    }

    /// First and last `s` \[m\]; of a closed road those of one round.
    pub fn extent_m(&self) -> (f64, f64) {
        (self.start_m, self.start_m + (self.samples.len() - 1) as f64 * STEP_M)
    }

    /// The centre line at `s`, extended straight beyond the ends; of a closed road round and round.
    pub fn at(&self, s: f64) -> RoadPoint {
        let s = self.round_m().map_or(s, |round| s.rem_euclid(round));
        let t = (s - self.start_m) / STEP_M;
        let i = (t.floor().max(0.0) as usize).min(self.samples.len() - 2);
        let (a, b, f) = (&self.samples[i], &self.samples[i + 1], t - i as f64);
        let inside = f.clamp(0.0, 1.0);
        let blend = |a: f64, b: f64| a + (b - a) * inside;
        RoadPoint {
            position: a.position + (b.position - a.position) * f,
            heading_rad: blend(a.heading_rad, b.heading_rad),
            curvature_per_m: blend(a.curvature_per_m, b.curvature_per_m),
            rise: blend(a.rise, b.rise),
        }
    }

    /// The site point at `s` along and `d` to the left of the centre line; lines across the road are level.
    pub fn point(&self, s: f64, d: f64) -> Point3<f64> {
        let p = self.at(s);
        p.position + Vector3::new(-p.heading_rad.sin(), p.heading_rad.cos(), 0.0) * d
    }

    /// `(s, d)` of a site point, by the nearest point of the centre line.
    pub fn locate(&self, point: &Point2<f64>) -> (f64, f64) {
        let distance = |p: &RoadPoint| (p.position.xy() - point).norm_squared();
        let nearest = self.samples.iter().enumerate().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
        let mut s = self.start_m + nearest.map_or(0.0, |(i, _)| i as f64) * STEP_M;
        let mut d = 0.0;
        for _ in 0..3 {
            let p = self.at(s);
            let (forward, left) = axes(p.heading_rad);
            let offset = point - p.position.xy();
            d = offset.dot(&left);
            s += offset.dot(&forward) / (1.0 - p.curvature_per_m * d).max(0.2);
        }
        (s, d)
    }

    /// Height of the carriageway \[m\] and its gradient at a site point.
    pub fn surface(&self, point: &Point2<f64>) -> (f64, Vector2<f64>) {
        let p = self.at(self.locate(point).0);
        (p.position.z, axes(p.heading_rad).0 * p.rise)
    }

    /// Distance along the road to the nearest crossing \[m\].
    pub fn to_crossing_m(&self, s: f64) -> f64 {
        let away = |c: &f64| match self.round_m() {
            Some(round) => {
                let ahead = (c - s).rem_euclid(round);
                ahead.min(round - ahead)
            }
            None => (c - s).abs(),
        };
        self.crossings_m.iter().map(away).fold(f64::INFINITY, f64::min)
    }
}

/// The samples that lie on the line of much earlier ones, in either direction.
fn again(samples: &[RoadPoint]) -> Vec<bool> {
    let on = |a: &RoadPoint, b: &RoadPoint| {
        let (forward, left) = axes(b.heading_rad);
        let off = a.position.xy() - b.position.xy();
        let parallel = (a.heading_rad - b.heading_rad).sin().abs() < 0.05;
        off.dot(&forward).abs() <= 0.5 * STEP_M && off.dot(&left).abs() < 0.2 && parallel
    };
    let early = |i: usize| &samples[..(i + 1).saturating_sub(APART)];
    (0..samples.len()).map(|i| early(i).iter().any(|b| on(&samples[i], b))).collect()
}

/// Forward and left unit vectors of a heading.
pub(crate) fn axes(heading_rad: f64) -> (Vector2<f64>, Vector2<f64>) {
    let (sin, cos) = heading_rad.sin_cos();
    (Vector2::new(cos, sin), Vector2::new(-sin, cos))
}

fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}

fn stretch(stretches: impl Iterator<Item = (f64, f64)>, s: f64) -> f64 {
    let mut begin = 0.0;
    for (length, value) in stretches {
        if s >= begin && s < begin + length {
            return value;
        }
        begin += length;
    }
    0.0
}

/// Triangle-weighted mean around `s`: its derivative is continuous.
fn averaged(f: &dyn Fn(f64) -> f64, s: f64) -> f64 {
    const TAPS: i32 = 14;
    let (mut sum, mut weights) = (0.0, 0.0);
    for i in -TAPS..=TAPS {
        let weight = f64::from(TAPS + 1 - i.abs());
        sum += weight * f(s + f64::from(i) / f64::from(TAPS) * TRANSITION_M);
        weights += weight;
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn winding_plan() -> RoadPlan {
        RoadPlan {
            half_width_m: 4.0,
            bends: vec![Bend { length_m: 60.0, curvature_per_m: 0.02 }],
            grades: vec![Grade { length_m: 80.0, rise: 0.05 }],
            crossings_m: vec![30.0],
            closed: false,
            corners_m: vec![],
            paved: vec![],
            kind: RoadKind::Street,
        }
    }

    fn winding() -> Road {
        Road::build(&winding_plan(), -40.0, 160.0)
    }

    #[test]
    fn locate_inverts_point() {
        let road = winding();
        for (s, d) in [(-20.0, 3.0), (12.3, -2.0), (40.7, 6.0), (120.0, -8.0)] {
            let (found_s, found_d) = road.locate(&road.point(s, d).xy());
            assert!((found_s - s).abs() < 0.05 && (found_d - d).abs() < 0.02, "{found_s} {found_d}");
        }
    }

    #[test]
    fn bends_turn_and_grades_climb_by_what_the_plan_says() {
        let road = winding();
        let end = road.at(150.0);
        assert!((end.heading_rad - 1.2).abs() < 0.02, "60 m at 1/50 m are 1.2 rad");
        assert!((end.position.z - 4.0).abs() < 0.1, "80 m at 5 % are 4 m");
        assert_eq!(road.to_crossing_m(22.0), 8.0);
    }

    #[test]
    fn a_closed_road_goes_round_and_round() {
        let bend = |length_m: f64, turn: f64| Bend { length_m, curvature_per_m: turn / length_m };
        let quarter = -std::f64::consts::FRAC_PI_2;
        let bends = [70.0, 50.0, 70.0, 50.0].into_iter().flat_map(|l| [bend(l, 0.0), bend(25.0, quarter)]);
        let (bends, crossings_m) = (bends.collect(), vec![20.0]);
        let plan = RoadPlan { bends, grades: vec![], crossings_m, closed: true, ..winding_plan() };
        let road = Road::build(&plan, -50.0, 800.0);
        assert_eq!(
            (road.round_m(), road.extent_m(), road.driven_m()),
            (Some(340.0), (0.0, 340.0), (-50.0, 800.0))
        );
        assert!((road.point(12.5, -1.75) - road.point(352.5, -1.75)).norm() < 1e-9);
        for i in 0..340 {
            let (a, b) = (road.at(f64::from(i)), road.at(f64::from(i + 1)));
            assert!(((b.position - a.position).norm() - 1.0).abs() < 0.02, "{i}");
        }
        assert!(
            (road.to_crossing_m(345.0) - 15.0).abs() < 1e-9
                && (road.to_crossing_m(330.0) - 30.0).abs() < 1e-9
        );
    }

    #[test]
    fn a_town_is_driven_by_its_corners_and_its_streets_again() {
        let block = [[0.0, 0.0], [150.0, 0.0], [150.0, 120.0], [0.0, 120.0]];
        let corners_m = [&block[..], &block[..2], &[[300.0, 0.0]]].concat();
        let plan = RoadPlan { corners_m, grades: vec![], bends: vec![], ..winding_plan() };
        let road = Road::build(&plan, -30.0, 800.0);
        assert!((road.at(0.0).position - Point3::origin()).norm() < 0.6);
        let from = road.extent_m().0;
        let again: Vec<f64> =
            (0..road.samples.len()).map(|i| from + i as f64).filter(|s| road.is_again(*s)).collect();
        // The first street up to its corner, but for the rounding into it.
        assert!((100.0..112.0).contains(&(again.len() as f64)), "{}", again.len());
        assert!(again.iter().all(|s| road.at(*s).position.y.abs() < 0.2 && *s > 400.0));
    }

    #[test]
    fn a_road_through_its_own_points_is_the_same_road() {
        let road = winding();
        let points: Vec<_> = (0..=100).map(|i| road.point(f64::from(i), 0.0)).collect();
        let again = Road::through(&points, 4.0);
        let (a, b) = (road.point(50.5, 3.0), again.point(50.5, 3.0));
        assert!((a - b).norm() < 0.01);
    }
}
