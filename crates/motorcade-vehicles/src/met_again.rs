//! Standing vehicles that are passed a second time.

use std::ops::RangeInclusive;

use motorcade_geometry::{Pose, Vehicle};
use nalgebra::{Matrix2, Matrix6, Vector2, Vector3, Vector6};

use crate::options::AdvancedVehicleOptions;
use crate::trajectory::{PoseObservation, VehicleState, VehicleTrajectory};

/// Makes one vehicle of those that stand in the same place in several passes, with the identity of the first pass. `joined(earlier, later)`
/// says of two spans of frames whether places seen again join them: without that, drift would put one vehicle into the place of
/// another. Also returns how many passes were joined to earlier ones.
pub fn join_met_again(
    vehicles: Vec<VehicleTrajectory>,
    options: &AdvancedVehicleOptions,
    joined: impl Fn(&RangeInclusive<usize>, &RangeInclusive<usize>) -> bool,
) -> (Vec<VehicleTrajectory>, usize) {
    let mut in_time: Vec<VehicleTrajectory> = vehicles;
    in_time.sort_by_key(|v| (v.states.first().map_or(usize::MAX, |s| s.frame), v.id));
    let (mut out, mut count): (Vec<VehicleTrajectory>, usize) = (Vec::with_capacity(in_time.len()), 0);
    for vehicle in in_time {
        let candidates = out.iter().enumerate().filter_map(|(k, earlier)| {
            let (before, after) = (last_pass(earlier)?, last_pass(&vehicle)?);
            let apart_m = same_place(earlier, &vehicle, options)?;
            (before.end() + 1 < *after.start() && joined(&before, &after)).then_some((apart_m, k))
        });
        let nearest = candidates.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match nearest.and_then(|(_, k)| out.get_mut(k)) {
            Some(earlier) => {
                join(earlier, vehicle);
                count += 1;
            }
            None => out.push(vehicle),
        }
    }
    out.sort_by_key(|v| v.id);
    (out, count)
}

/// The frames of the last pass: states have one a frame, so that a gap ends a pass.
fn last_pass(vehicle: &VehicleTrajectory) -> Option<RangeInclusive<usize>> {
    let pass = vehicle.states.chunk_by(|a, b| a.frame + 1 == b.frame).next_back()?;
    Some(pass.first()?.frame..=pass.last()?.frame)
}

/// The state that is known best.
pub(crate) fn best(vehicle: &VehicleTrajectory) -> Option<&VehicleState> {
    let variance = |s: &VehicleState| s.covariance.fixed_view::<3, 3>(3, 3).trace();
    vehicle.states.iter().min_by(|a, b| variance(a).total_cmp(&variance(b)))
}

/// Distance of two standing vehicles that may be one \[m\]; `None` of others.
fn same_place(a: &VehicleTrajectory, b: &VehicleTrajectory, options: &AdvancedVehicleOptions) -> Option<f64> {
    let (gates, moving_from) = (&options.met_again, options.kinematic_state.moving_from);
    // A vehicle that was seen too shortly to decide has just this probability, and does not count as standing.
    if a.p_moving >= moving_from || b.p_moving >= moving_from {
        return None;
    }
    let (p, q) = (best(a)?, best(b)?);
    let apart = p.world_from_vehicle.inverse() * q.world_from_vehicle;
    let rotation = apart.rotation_matrix();
    let turn: Matrix2<f64> = rotation.fixed_view::<2, 2>(0, 0).into_owned();
    let across: Vector2<f64> = apart.translation().xy();
    let block = |s: &VehicleState| -> Matrix2<f64> { s.covariance.fixed_view::<2, 2>(3, 3).into_owned() };
    let covariance = block(p) + turn * block(q) * turn.transpose();
    let squared = across.dot(&(covariance.try_inverse()? * across));
    let sizes = [a.size.length_m / b.size.length_m, a.size.height_m / b.size.height_m];
    let alike =
        sizes.iter().all(|ratio| (gates.least_size_share..=1.0 / gates.least_size_share).contains(ratio));
    let near = across.norm() <= gates.most_apart_m && squared <= gates.gate_chi2;
    (near && alike && rotation[(0, 0)].abs() >= gates.least_cosine).then(|| across.norm())
}

/// Adds the states of a later pass to those of the earlier ones, for one size and with the front of the earlier ones.
pub(crate) fn join(earlier: &mut VehicleTrajectory, mut later: VehicleTrajectory) {
    let heading =
        |v: &VehicleTrajectory| best(v).map(|s| s.world_from_vehicle.transform_vector(&Vector3::x()));
    if heading(earlier).zip(heading(&later)).is_some_and(|(a, b)| a.dot(&b) < 0.0) {
        later.states.iter_mut().for_each(turn_round);
    }
    let (variance, other) = (earlier.scale_variance(), later.scale_variance());
    let apart = (later.size.height_m / earlier.size.height_m).ln();
    // The better known size counts: both have the same prior, so that they do not confirm each other.
    if other < variance {
        shift(&mut earlier.states, apart);
        earlier.rescale(apart, other);
        earlier.size_by_road = later.size_by_road;
    } else {
        shift(&mut later.states, -apart);
    }
    let odds = |p: f64| p / (1.0 - p).max(1e-9);
    let both = odds(earlier.p_moving) * odds(later.p_moving);
    earlier.p_moving = both / (1.0 + both);
    earlier.states.append(&mut later.states);
}

/// The state of the same cuboid with front and rear exchanged: half a turn about the vehicle's own upward axis.
fn turn_round(state: &mut VehicleState) {
    let half: Pose<Vehicle, Vehicle> =
        Pose::exp(&Vector6::new(0.0, 0.0, std::f64::consts::PI, 0.0, 0.0, 0.0));
    // Tangents `[ω, ν]` of the vehicle's frame: forward and left change sign.
    let signs = Matrix6::from_diagonal(&Vector6::new(-1.0, -1.0, 1.0, -1.0, -1.0, 1.0));
    let turned = |covariance: &Matrix6<f64>| signs * covariance * signs;
    state.world_from_vehicle = state.world_from_vehicle * half;
    state.covariance = turned(&state.covariance);
    if let Some(measurement) = &mut state.measurement {
        measurement.camera_from_vehicle = measurement.camera_from_vehicle * half;
        measurement.covariance = turned(&measurement.covariance);
    }
    if let Some(rival) = &mut state.rival {
        rival.offset_m = half.rotation_matrix().transpose() * rival.offset_m;
        rival.covariance = turned(&rival.covariance);
    }
    for observation in &mut state.observations {
        observation.camera_from_vehicle = observation.camera_from_vehicle * half;
        observation.covariance = turned(&observation.covariance);
        observation.scale_derivative = signs * observation.scale_derivative;
        observation.common_derivative = signs * observation.common_derivative;
    }
}

/// Observations as they are when the logarithm of the size is larger by `by`.
fn shift(states: &mut [VehicleState], by: f64) {
    let moved = |o: &mut PoseObservation| {
        o.camera_from_vehicle = o.camera_from_vehicle.retract(&(o.scale_derivative * by));
    };
    states.iter_mut().flat_map(|s| &mut s.observations).for_each(moved);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::standing_car;
    use motorcade_shape::Dimensions;

    fn vehicle(id: usize, frames: std::ops::Range<usize>, at: [f64; 2], p_moving: f64) -> VehicleTrajectory {
        let size = Dimensions { length_m: 4.2, width_m: 1.8, height_m: 1.5 };
        VehicleTrajectory { p_moving, size, ..standing_car(id, frames, at) }
    }

    fn ids(vehicles: &[VehicleTrajectory]) -> Vec<(usize, usize)> {
        vehicles.iter().map(|v| (v.id, v.states.len())).collect()
    }

    #[test]
    fn a_parked_car_passed_again_is_the_same_one() {
        let all = vec![
            vehicle(1, 10..20, [0.0, 3.0], 0.1),
            vehicle(2, 15..25, [7.0, 3.0], 0.1),
            vehicle(7, 500..512, [0.4, 3.2], 0.1),
            vehicle(9, 900..904, [-0.3, 2.9], 0.1),
        ];
        let (found, count) = join_met_again(all, &AdvancedVehicleOptions::default(), |_, _| true);
        assert_eq!((ids(&found), count), (vec![(1, 26), (2, 10)], 2));
        assert!(found[0].p_moving < 0.01);
    }

    /// A detector took the rear of one pass for the front in the other.
    #[test]
    fn passes_have_one_front() {
        let mut reversed = vehicle(2, 500..510, [0.3, 3.0], 0.1);
        reversed.states.iter_mut().for_each(turn_round);
        reversed.states[0].covariance[(3, 5)] = 0.01;
        reversed.states[0].covariance[(5, 3)] = 0.01;
        let options = AdvancedVehicleOptions::default();
        let (found, _) =
            join_met_again(vec![vehicle(1, 10..20, [0.0, 3.0], 0.1), reversed], &options, |_, _| true);
        let forward = |s: &VehicleState| s.world_from_vehicle.transform_vector(&Vector3::x()).x;
        assert_eq!(found.len(), 1);
        assert!(found[0].states.iter().all(|s| forward(s) > 0.999));
        assert!((found[0].states[10].world_from_vehicle.translation().x - 0.3).abs() < 1e-9);
        assert_eq!(found[0].states[10].covariance[(3, 5)], -0.01);
    }

    #[test]
    fn other_vehicles_stay_others() {
        let options = AdvancedVehicleOptions::default();
        let first = || vehicle(1, 10..20, [0.0, 3.0], 0.1);
        let turned = |mut v: VehicleTrajectory| {
            let across = Pose::exp(&Vector6::new(0.0, 0.0, 1.4, 0.0, 0.0, 0.0));
            v.states.iter_mut().for_each(|s| s.world_from_vehicle = s.world_from_vehicle * across);
            v
        };
        let larger = |mut v: VehicleTrajectory| {
            v.size.length_m = 9.0;
            v
        };
        for (name, second) in [
            ("beside it", vehicle(2, 500..510, [2.3, 3.0], 0.1)),
            ("beyond its deviations", vehicle(2, 500..510, [0.0, 4.7], 0.1)),
            ("it moves", vehicle(2, 500..510, [0.0, 3.0], 0.8)),
            ("at the same time", vehicle(2, 15..30, [0.0, 3.0], 0.1)),
            ("across", turned(vehicle(2, 500..510, [0.0, 3.0], 0.1))),
            ("a lorry", larger(vehicle(2, 500..510, [0.0, 3.0], 0.1))),
        ] {
            let (_, count) = join_met_again(vec![first(), second], &options, |_, _| true);
            assert_eq!(count, 0, "{name}");
        }
        let same = vec![first(), vehicle(2, 500..510, [0.0, 3.0], 0.1)];
        assert_eq!(join_met_again(same, &options, |_, _| false).1, 0);
    }
}
