//! Lines through points.

use nalgebra::{Point2, Point3, Vector3};

/// Points a metre apart along the line through some points.
pub(crate) fn every_metre(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut out: Vec<Point3<f64>> = points.first().copied().into_iter().collect();
    let mut rest = 1.0;
    for pair in points.windows(2) {
        let length = (pair[1] - pair[0]).xy().norm();
        let mut at = rest;
        while at <= length {
            out.push(pair[0] + (pair[1] - pair[0]) * (at / length));
            at += 1.0;
        }
        rest = at - length;
    }
    out
}

/// Mean over nine neighbours, fewer towards the ends.
pub(crate) fn averaged(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let n = points.len();
    let mean = |i: usize| {
        let reach = 4.min(i).min(n - 1 - i);
        let sum: Vector3<f64> = points[i - reach..=i + reach].iter().map(|p| p.coords).sum();
        Point3::from(sum / (2 * reach + 1) as f64)
    };
    (0..n).map(mean).collect()
}

/// Line through some corners, each rounded to an arc that leaves its streets `reach_m` before and after it, with points a metre apart. A corner
/// on the straight line between its neighbours stays as it is.
pub(crate) fn rounded(corners: &[Point2<f64>], reach_m: f64) -> Vec<Point3<f64>> {
    let mut points: Vec<Point3<f64>> = Vec::new();
    let mut add = |p: Point2<f64>| points.push(Point3::new(p.x, p.y, 0.0));
    corners.first().into_iter().for_each(|p| add(*p));
    for three in corners.windows(3) {
        let [before, corner, after] = [three[0], three[1], three[2]];
        let (into, out) = ((corner - before).normalize(), (after - corner).normalize());
        let turn = (into.x * out.y - into.y * out.x).atan2(into.dot(&out));
        if turn.abs() < 1e-6 {
            add(corner);
            continue;
        }
        let radius_m = reach_m / (0.5 * turn.abs()).tan();
        let begin = corner - into * reach_m;
        let to_centre = nalgebra::Vector2::new(-into.y, into.x) * turn.signum() * radius_m;
        let steps = (radius_m * turn.abs()).ceil().max(2.0) as usize;
        for i in 0..=steps {
            let angle = turn * i as f64 / steps as f64;
            let from_centre = nalgebra::Rotation2::new(angle) * -to_centre;
            add(begin + to_centre + from_centre);
        }
    }
    corners.last().into_iter().for_each(|p| add(*p));
    every_metre(&points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_become_arcs_between_straight_lines() {
        let corners = [[0.0, 0.0], [50.0, 0.0], [100.0, 0.0], [100.0, 80.0]].map(Point2::from);
        let line = rounded(&corners, 20.0);
        let straight = line.iter().filter(|p| p.x < 79.0).all(|p| p.y.abs() < 1e-9);
        let middle = Point2::new(80.0 + 20.0 * 0.5_f64.sqrt(), 20.0 - 20.0 * 0.5_f64.sqrt());
        let nearest = line.iter().map(|p| (p.xy() - middle).norm()).fold(f64::INFINITY, f64::min);
        assert!(straight && nearest < 0.6, "{nearest}");
        let steps = line.windows(2).map(|w| (w[1] - w[0]).norm());
        assert!(steps.clone().all(|s| (0.99..1.001).contains(&s)));
    }
}
