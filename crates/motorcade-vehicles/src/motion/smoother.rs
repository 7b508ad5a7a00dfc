//! Smoothed motion of a whole track.

use motorcade_geometry::rts::{self, FilterStep, Smoothed};
use nalgebra::Vector3;

use crate::motion::{KinematicState, MotionFilter, PositionMeasurement};
use crate::options::AdvancedVehicleOptions;
use crate::time::{correlation_factor, frame_interval_s};

/// Slack when measurements are assigned to times \[s\].
const ROUNDING_S: f64 = 1e-9;

/// Smooths positions (in order of time) with the white-noise-acceleration model (Rauch–Tung–Striebel). `times` are those of the
/// returned states and must include the positions' times; `up` is the road normal in the world.
pub fn smooth_motion(
    positions: &[PositionMeasurement],
    times: &[f64],
    up: &Vector3<f64>,
    options: &AdvancedVehicleOptions,
) -> Vec<KinematicState> {
    let Some(first) = positions.first() else { return Vec::new() };
    // Errors of consecutive views are correlated: their variances are inflated.
    let interval_s = frame_interval_s(times).unwrap_or(options.correlation_time_s);
    let correlation = correlation_factor(options.correlation_time_s, interval_s);
    let options = &options.motion;
    let widened = first.covariance * correlation * options.initial_position_factor;
    let mut filter = MotionFilter::new(&first.position, &widened, options);
    let (mut time, mut next) = (times.first().copied().unwrap_or(0.0), 0);
    let mut steps: Vec<FilterStep<6>> = Vec::with_capacity(times.len());
    for t in times {
        let transition = filter.predict(t - time, up, options);
        let (predicted, predicted_covariance) = (filter.x, filter.p);
        while let Some(measured) = positions.get(next).filter(|m| m.time_s <= t + ROUNDING_S) {
            filter.update(&measured.position, &(measured.covariance * correlation), options);
            next += 1;
        }
        let (filtered, filtered_covariance) = (filter.x, filter.p);
        steps.push(FilterStep { transition, predicted, predicted_covariance, filtered, filtered_covariance });
        time = *t;
    }
    rts::smooth(&steps).iter().map(kinematic_state).collect()
}

fn kinematic_state(state: &Smoothed<6>) -> KinematicState {
    KinematicState {
        position: state.mean.fixed_rows::<3>(0).into_owned(),
        velocity: state.mean.fixed_rows::<3>(3).into_owned(),
        covariance: state.covariance,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::kinematic_state::tests::positions;

    #[test]
    fn smoothing_bridges_a_gap() {
        let mut measured = positions(8.0);
        let times: Vec<f64> = measured.iter().map(|p| p.time_s).collect();
        measured.drain(10..18);
        let states = smooth_motion(&measured, &times, &-Vector3::y(), &AdvancedVehicleOptions::default());
        assert_eq!(states.len(), 30);
        for (state, t) in states.iter().zip(&times) {
            assert!((state.position.z - 20.0 - 8.0 * t).abs() < 0.05);
            assert!((state.velocity.z - 8.0).abs() < 0.2);
        }
        assert!(states[14].covariance[(2, 2)] > states[5].covariance[(2, 2)]);
    }
}
