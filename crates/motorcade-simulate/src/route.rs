//! Routes as paths on a built road.

use nalgebra::Point2;

use crate::error::{Error, Result};
use crate::motion::{Path, Road, axes};
use crate::plan::{Route, Side};

/// Gap between a parked vehicle and the kerb \[m\].
pub(crate) const PARKING_INSET_M: f64 = 0.25;
/// Distance of a lane's centre from the centre line \[m\].
pub(crate) const LANE_M: f64 = 1.75;
/// Distance between path points \[m\].
const STEP_M: f64 = 0.5;
/// Length of a path on a crossing road \[m\].
const ARM_M: f64 = 90.0;

/// The path of a route, and the distance of the start along it \[m\].
pub(crate) fn path(road: &Road, route: &Route, width_m: f64) -> Result<(Path, f64)> {
    let (from, to) = road.driven_m();
    let (points, start_m): (Vec<Point2<f64>>, f64) = match route {
        Route::Along { start_m, offsets_m } => {
            let lead = start_m - 12.0;
            (line(lead, to, |s| road.point(s, offset(offsets_m, s)).xy()), start_m - lead)
        }
        Route::Oncoming { start_m } => {
            let lead = start_m + 12.0;
            (line(0.0, lead - from, |way| road.point(lead - way, LANE_M).xy()), 12.0)
        }
        Route::ThereAndBack { start_m, turn_m } => {
            let lead = start_m - 12.0;
            let mut points = line(lead, *turn_m, |s| road.point(s, -swung(*turn_m - s)).xy());
            let arc = line(0.0, std::f64::consts::PI * TURN_M, |way| {
                let (sin, cos) = (way / TURN_M).sin_cos();
                road.point(turn_m + TURN_M * sin, -TURN_M * cos).xy()
            });
            points.extend(arc);
            points.extend(line(0.0, turn_m - from, |way| road.point(turn_m - way, swung(way)).xy()));
            (points, start_m - lead)
        }
        Route::Crossing { crossing, from, distance_m } => {
            let arm = Arm::of(road, *crossing, *from)?;
            let begin = distance_m + 12.0;
            // Right-hand traffic: towards the crossing, the centre of the crossing road is on its left.
            (line(0.0, begin + ARM_M, |way| arm.point(begin - way, -LANE_M)), 12.0)
        }
        Route::TurnOff { start_m, crossing, to } => {
            let arm = Arm::of(road, *crossing, *to)?;
            let (lead, corner) = (start_m - 12.0, turn_radius(*to));
            let mut points = line(lead, arm.s - corner, |s| road.point(s, -LANE_M).xy());
            // Right-hand traffic: away from the crossing, that is the other side.
            let end = line(corner, ARM_M, |out| arm.point(out, LANE_M));
            join(&mut points, end);
            (points, 12.0)
        }
        Route::TurnIn { crossing, distance_m } => {
            let arm = Arm::of(road, *crossing, Side::Right)?;
            let begin = distance_m + 12.0;
            let corner = turn_radius(Side::Right);
            let mut points = line(0.0, begin - corner, |way| arm.point(begin - way, -LANE_M));
            join(&mut points, line(arm.s + corner, to, |s| road.point(s, -LANE_M).xy()));
            (points, 12.0)
        }
        Route::Through { points_m, start_m } => (through(road, points_m), *start_m),
        Route::Standing { s_m, d_m, .. } => (line(s_m - 12.0, *s_m, |s| road.point(s, *d_m).xy()), 12.0),
        Route::Parked { s_m, side } => {
            let d = side.sign() * (road.half_width_m - PARKING_INSET_M - 0.5 * width_m);
            (line(s_m - 12.0, *s_m, |s| road.point(s, d).xy()), 12.0)
        }
    };
    let path = Path::through(points)
        .ok_or_else(|| Error::Plan("a route starts beyond the end of the road".into()))?;
    Ok((path, start_m))
}

/// Radius of a turn over both lanes \[m\]: that of a car's path at four fifths of full lock.
const TURN_M: f64 = 6.25;
/// Way over which the car swings out before that turn, and back after it \[m\].
const SWING_M: f64 = 24.0;

/// Distance from the centre line, `ahead_m` before or after a turn over both lanes \[m\].
fn swung(ahead_m: f64) -> f64 {
    let t = (1.0 - ahead_m / SWING_M).clamp(0.0, 1.0);
    LANE_M + (TURN_M - LANE_M) * t * t * (3.0 - 2.0 * t)
}

fn turn_radius(to: Side) -> f64 {
    match to {
        Side::Right => 8.0,
        Side::Left => 9.0,
    }
}

/// One side of a crossing road.
struct Arm<'a> {
    road: &'a Road,
    s: f64,
    sign: f64,
}

impl<'a> Arm<'a> {
    fn of(road: &'a Road, crossing: usize, side: Side) -> Result<Self> {
        let s = road.crossings_m.get(crossing).copied().ok_or_else(|| {
            Error::Plan(format!("a route uses crossing {crossing}, the road has {}", road.crossings_m.len()))
        })?;
        Ok(Self { road, s, sign: side.sign() })
    }
    /// `out` metres from the centre of the crossing, `left` metres to the left of incoming traffic.
    fn point(&self, out: f64, left: f64) -> Point2<f64> {
        // The crossing road is straight, in the axes at its centre.
        let centre = self.road.at(self.s);
        let (forward, to_left) = axes(centre.heading_rad);
        // Traffic from the left heads to the right, with the road's forward direction on its left.
        centre.position.xy() + to_left * (self.sign * out) + forward * (self.sign * left)
    }
}

/// Adds `rest` after a rounded corner (quadratic Bézier between the two ends, with their intersection as control point).
pub(crate) fn join(points: &mut Vec<Point2<f64>>, rest: Vec<Point2<f64>>) {
    if let ([.., a, b], [c, d, ..]) = (points.as_slice(), rest.as_slice()) {
        let (b, c) = (*b, *c);
        let (u, v) = ((b - a).normalize(), (c - d).normalize());
        let cross = u.x * v.y - u.y * v.x;
        let w = c - b;
        // Intersection of the two straight ends.
        let corner = if cross.abs() > 1e-6 { b + u * ((w.x * v.y - w.y * v.x) / cross) } else { b + w * 0.5 };
        let steps = ((c - b).norm() / STEP_M).ceil().max(2.0) as usize;
        for i in 1..steps {
            let t = i as f64 / steps as f64;
            let point =
                b.coords * (1.0 - t).powi(2) + corner.coords * (2.0 * t * (1.0 - t)) + c.coords * (t * t);
            points.push(point.into());
        }
    }
    points.extend(rest);
}

fn line(from: f64, to: f64, point: impl Fn(f64) -> Point2<f64>) -> Vec<Point2<f64>> {
    let count = ((to - from) / STEP_M).ceil().max(0.0) as usize;
    (0..=count).map(|i| point(from + i as f64 * STEP_M)).collect()
}

/// Points along straight lines in (s, d).
fn through(road: &Road, points_m: &[[f64; 2]]) -> Vec<Point2<f64>> {
    let between = |pair: &[[f64; 2]]| {
        let [a, b] = [pair[0], pair[1]].map(Point2::from);
        let steps = ((b - a).norm() / STEP_M).ceil().max(1.0) as usize;
        (0..steps).map(move |i| a + (b - a) * (i as f64 / steps as f64))
    };
    let last = points_m.last().map(|p| Point2::from(*p));
    points_m.windows(2).flat_map(between).chain(last).map(|p| road.point(p.x, p.y).xy()).collect()
}

/// Smoothstep between knots: the direction is continuous.
fn offset(knots: &[(f64, f64)], s: f64) -> f64 {
    let after = knots.partition_point(|k| k.0 <= s);
    match (after.checked_sub(1).and_then(|i| knots.get(i)), knots.get(after)) {
        (Some(a), Some(b)) => {
            let t = (s - a.0) / (b.0 - a.0);
            a.1 + (b.1 - a.1) * t * t * (3.0 - 2.0 * t)
        }
        (Some(only), None) | (None, Some(only)) => only.1,
        (None, None) => -LANE_M,
    }
}
