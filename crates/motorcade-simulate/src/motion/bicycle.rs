//! Kinematic bicycle model: no side slip at the rear axle, the front wheel steers towards the path.

use nalgebra::Point2;

use super::{Path, SpeedPlan};

/// Positions of the axles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axles {
    /// Distance from front to rear axle \[m\].
    pub wheelbase_m: f64,
    /// Distance from rear axle to body centre \[m\].
    pub rear_to_centre_m: f64,
}

/// State of the body centre in the level plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlanarState {
    pub centre: Point2<f64>,
    pub heading_rad: f64,
    pub speed_m_s: f64,
}

const STEP_S: f64 = 0.01;
const STEER_LIMIT_RAD: f64 = 0.65;

/// Follows a path from `start_m` along it (pure pursuit, Coulter 1992); returns the state at each frame.
pub(crate) fn follow(
    path: &Path,
    start_m: f64,
    axles: Axles,
    speed: &SpeedPlan,
    frames: usize,
    fps: f64,
) -> Vec<PlanarState> {
    let (mut rear, direction) = path.at(start_m - axles.rear_to_centre_m);
    let mut heading_rad = direction.y.atan2(direction.x);
    let mut along = start_m - axles.rear_to_centre_m;
    let steps_per_frame = (1.0 / (fps * STEP_S)).round().max(1.0) as usize;
    let dt = 1.0 / (fps * steps_per_frame as f64);
    let mut states = Vec::with_capacity(frames);
    for step in 0..frames.saturating_sub(1) * steps_per_frame + 1 {
        let time_s = step as f64 * dt;
        let v = speed.at(time_s);
        let forward = super::road::axes(heading_rad).0;
        if step % steps_per_frame == 0 {
            let centre = rear + forward * axles.rear_to_centre_m;
            states.push(PlanarState { centre, heading_rad, speed_m_s: v });
        }
        along = path.progress(&rear, along);
        // Look-ahead of half a second, and never less than smooth steering needs.
        let ahead = path.at(along + (0.5 * v).max(3.5)).0 - rear;
        let alpha = ahead.y.atan2(ahead.x) - heading_rad;
        let curvature = 2.0 * alpha.sin() / ahead.norm().max(1e-3);
        let steer = (axles.wheelbase_m * curvature).atan().clamp(-STEER_LIMIT_RAD, STEER_LIMIT_RAD);
        rear += forward * (v * dt);
        heading_rad += v * steer.tan() / axles.wheelbase_m * dt;
    }
    states
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXLES: Axles = Axles { wheelbase_m: 2.6, rear_to_centre_m: 1.25 };

    #[test]
    fn a_circle_is_followed_without_side_slip() {
        let circle = |i: i32| {
            Point2::new(20.0 * (f64::from(i) / 40.0).sin(), 20.0 * (1.0 - (f64::from(i) / 40.0).cos()))
        };
        let path = Path::through((0..200).map(circle)).unwrap();
        let states = follow(&path, 5.0, AXLES, &SpeedPlan::constant(6.0), 60, 10.0);
        assert_eq!(states.len(), 60);
        for pair in states.windows(2) {
            let off = (pair[1].centre - Point2::new(0.0, 20.0)).norm() - 20.0;
            assert!(off.abs() < 0.4, "{off} m off the circle");
            // The rear axle moves along the heading.
            let rear = |s: &PlanarState| {
                s.centre - super::super::road::axes(s.heading_rad).0 * AXLES.rear_to_centre_m
            };
            let moved = rear(&pair[1]) - rear(&pair[0]);
            let left = super::super::road::axes(0.5 * (pair[0].heading_rad + pair[1].heading_rad)).1;
            assert!(moved.dot(&left).abs() < 2e-3 && (moved.norm() - 0.6).abs() < 2e-3);
        }
    }
}
