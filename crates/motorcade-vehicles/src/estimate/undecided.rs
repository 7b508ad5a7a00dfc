//! Vehicles that may stand or move.

use super::headings::external_headings;
use super::hypothesis::TrackHypothesis;
use super::input::TrackInput;
use crate::trajectory::{RivalState, VehicleState, VehicleTrajectory};

/// The other hypothesis: a vehicle that moves where the more probable one stands, and the other way round.
pub(super) fn rival(
    input: &TrackInput<'_>,
    times: &[f64],
    best: &TrackHypothesis,
) -> Option<TrackHypothesis> {
    let stands = best.p_moving <= input.options.advanced.kinematic_state.moving_from;
    let given = external_headings(input, times.len());
    let initial = given.clone().unwrap_or_else(|| vec![0.0; times.len()]);
    TrackHypothesis::new(input, times, given.as_deref(), initial, Some(stands), &best.views.boxes)
}

/// The more probable hypothesis, with the states of the other one beside its own.
pub(super) fn with_rival(mut probable: VehicleTrajectory, rival: &[VehicleState]) -> VehicleTrajectory {
    let probability = probable.p_moving.min(1.0 - probable.p_moving);
    for (state, other) in probable.states.iter_mut().zip(rival) {
        let turn = state.world_from_vehicle.rotation().inverse() * other.world_from_vehicle.rotation();
        let turn = turn.to_rotation_matrix();
        let mut covariance = other.covariance;
        let mut position = covariance.fixed_view_mut::<3, 3>(3, 3);
        position.copy_from(&(turn * position.clone_owned() * turn.transpose()));
        let rival = RivalState {
            probability,
            offset_m: (state.world_from_vehicle.inverse() * other.world_from_vehicle).translation(),
            turn_rad: turn[(1, 0)].atan2(turn[(0, 0)]),
            covariance,
            speed_mps: other.speed_mps,
            speed_sigma_mps: other.speed_sigma_mps,
            yaw_rate_radps: other.yaw_rate_radps,
        };
        // An improbable hypothesis may fail where the probable one does not.
        state.rival = rival.is_finite().then_some(rival);
    }
    probable
}

#[cfg(test)]
mod tests {
    use motorcade_geometry::Pose;
    use nalgebra::{Matrix6, UnitQuaternion, Vector3};

    use super::with_rival;
    use crate::test_vehicles::car_ahead;

    #[test]
    fn a_rival_is_in_the_covariance_and_not_in_the_state() {
        let mut stands = car_ahead(1, 2.0, 30.0);
        stands.p_moving = 0.3;
        for state in &mut stands.states {
            (state.covariance, state.speed_mps, state.speed_sigma_mps) = (Matrix6::identity(), 0.0, 0.1);
        }
        let mut moves = stands.states.clone();
        for state in &mut moves {
            let pose = state.world_from_vehicle;
            state.world_from_vehicle =
                Pose::from_parts(pose.rotation(), pose.translation() - 10.0 * Vector3::z());
            state.speed_mps = 8.0;
        }
        let mut both = with_rival(stands.clone(), &moves);
        both.states.iter_mut().for_each(crate::VehicleState::include_hypotheses);
        for (state, before) in both.states.iter().zip(&stands.states) {
            assert!(state.world_from_vehicle == before.world_from_vehicle && state.rival.is_none());
            // Forward is away from the camera here: 1 + 0.3 × 10².
            assert!((state.covariance[(3, 3)] - 31.0).abs() < 1e-9 && state.covariance[(4, 4)] < 1.0 + 1e-9);
            assert!((state.speed_sigma_mps - (0.01_f64 + 0.3 * 64.0).sqrt()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_rival_that_failed_leaves_the_probable_hypothesis_alone() {
        let stands = car_ahead(1, 2.0, 30.0);
        let mut moves = stands.states.clone();
        moves[0].covariance[(3, 3)] = f64::NAN;
        let both = with_rival(stands, &moves);
        assert!(both.states[0].rival.is_none() && both.states[1].rival.is_some());
    }

    #[test]
    fn a_mixture_has_the_moments_of_both_hypotheses() {
        let mut stands = car_ahead(1, 2.0, 30.0);
        stands.p_moving = 0.3;
        let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let mut moves = stands.states.clone();
        for state in &mut stands.states {
            (state.covariance, state.speed_mps, state.speed_sigma_mps) = (Matrix6::identity(), 0.0, 0.1);
        }
        for state in &mut moves {
            let pose = state.world_from_vehicle;
            // 10 m nearer and turned by a quarter; known to 2 m along its own axis, which is the other one's left.
            state.world_from_vehicle =
                Pose::from_parts(pose.rotation() * quarter, pose.translation() - 10.0 * Vector3::z());
            state.covariance = Matrix6::identity();
            state.covariance[(3, 3)] = 4.0;
            (state.speed_mps, state.speed_sigma_mps) = (8.0, 0.2);
        }
        let rotation = stands.states[0].world_from_vehicle.rotation();
        let mut mixed = with_rival(stands, &moves);
        mixed.states.iter_mut().for_each(crate::VehicleState::mix_rival);
        for state in &mixed.states {
            let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
            assert!(state.world_from_vehicle.rotation() == rotation);
            assert!(close(state.world_from_vehicle.translation().z, 27.0));
            let covariance = state.covariance;
            // Forward is away from the camera here: 0.7 + 0.3 + 0.21 × 10²; left: 0.7 + 0.3 × 4.
            assert!(close(covariance[(3, 3)], 22.0) && close(covariance[(4, 4)], 1.9), "{covariance}");
            assert!(close(covariance[(2, 2)], 1.0 + 0.21 * std::f64::consts::FRAC_PI_2.powi(2)));
            assert!(close(state.speed_mps, 2.4));
            let variance: f64 = 0.7 * 0.01 + 0.3 * 0.04 + 0.21 * 64.0;
            assert!(close(state.speed_sigma_mps, variance.sqrt()));
        }
    }
}
