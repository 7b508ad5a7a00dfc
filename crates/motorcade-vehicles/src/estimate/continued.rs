//! Moving vehicles whose track ended and went on as another.
//!
//! A vehicle that was hidden, or whose boxes a tracker gave to two tracks one after the other, becomes two vehicles. The second begins where the first would
//! be by then, at its speed.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix3, Vector3};

use super::drive::Drive;
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::met_again::join;
use crate::observed_box::overlap;
use crate::options::{HypothesisOptions, MetAgainOptions, VehicleOptions};
use crate::track::{Track, boxes_of};
use crate::trajectory::{VehicleState, VehicleTrajectory};

/// Makes one vehicle of two that move, of which the second begins where the motion of the first leads to within `longest_gap_s`, and whose boxes one
/// motion explains. It keeps the identity of the first, and each part its states: the box of a vehicle that comes out from behind another one would bend
/// the way before.
pub fn join_continued(
    (camera, grounds): (&PinholeCamera, &[GroundFrame]),
    vehicles: Vec<VehicleTrajectory>,
    tracks: &[Track],
    views: &impl Fn(&Track) -> ExternalTrack,
    options: &VehicleOptions,
    longest_gap_s: f64,
) -> Vec<VehicleTrajectory> {
    let drive = Drive { camera, grounds, views, options };
    let mut in_time = vehicles;
    in_time.sort_by_key(|v| (v.states.first().map_or(usize::MAX, |s| s.frame), v.id));
    // Each with its last part, whose motion leads to the next one.
    let mut out: Vec<(VehicleTrajectory, VehicleTrajectory)> = Vec::with_capacity(in_time.len());
    for vehicle in in_time {
        let leads = |(k, (_, last)): (usize, &(_, VehicleTrajectory))| {
            Some((leads_to(&drive, last, &vehicle, longest_gap_s)?, k))
        };
        let mut earlier: Vec<(f64, usize)> = out.iter().enumerate().filter_map(leads).collect();
        earlier.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match earlier.into_iter().find(|(_, k)| is_one(&drive, &out[*k].1, &vehicle, tracks)) {
            Some((_, k)) => {
                out[k].1 = vehicle.clone();
                join(&mut out[k].0, vehicle);
            }
            None => out.push((vehicle.clone(), vehicle)),
        }
    }
    let mut joined: Vec<VehicleTrajectory> = out.into_iter().map(|(vehicle, _)| vehicle).collect();
    joined.sort_by_key(|v| v.id);
    joined
}

/// χ² of the position and the speed with which the second vehicle begins, where the first one would be; `None` where they are two.
fn leads_to<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    first: &VehicleTrajectory,
    second: &VehicleTrajectory,
    longest_gap_s: f64,
) -> Option<f64> {
    let (from, to) = (first.states.last()?, second.states.first()?);
    let time_s = |s: &VehicleState| drive.grounds.get(s.frame).map(|g| g.time_s);
    let gap_s = time_s(to)? - time_s(from)?;
    let moves = drive.moves(first) && drive.moves(second);
    if !moves || from.frame >= to.frame || gap_s > longest_gap_s {
        return None;
    }
    let advanced = &drive.options.advanced;
    let gates = &advanced.met_again;
    let forward = |s: &VehicleState| s.world_from_vehicle.transform_vector(&Vector3::x());
    if !alike((first, from), (second, to), gates) {
        return None;
    }
    let position = |s: &VehicleState| s.world_from_vehicle.translation();
    let expected = position(from) + forward(from) * (from.speed_mps * gap_s);
    let difference = position(to) - expected;
    // Another vehicle of the lane is farther away than one is long.
    let longest_m = first.size.length_m.max(second.size.length_m);
    // White noise of the acceleration over the gap (Bar-Shalom et al., Estimation with Applications to Tracking and Navigation, 6.2.2).
    let density = advanced.motion.acceleration_density;
    let along = forward(from);
    let of_speed = along * along.transpose() * (from.speed_sigma_mps * gap_s).powi(2);
    let covariance = in_world(from)
        + in_world(to)
        + of_speed
        + Matrix3::identity() * (density.powi(2) * gap_s.powi(3) / 3.0);
    if difference.norm().max(covariance.trace().sqrt()) > longest_m {
        return None;
    }
    let speed_variance = from.speed_sigma_mps.powi(2) + to.speed_sigma_mps.powi(2) + density.powi(2) * gap_s;
    let chi2 = difference.dot(&(covariance.try_inverse()? * difference))
        + (to.speed_mps - from.speed_mps).powi(2) / speed_variance;
    (chi2 <= gates.gate_chi2).then_some(chi2)
}

/// True when two vehicles have one size, and in these states one heading.
pub(super) fn alike(
    (first, from): (&VehicleTrajectory, &VehicleState),
    (second, to): (&VehicleTrajectory, &VehicleState),
    gates: &MetAgainOptions,
) -> bool {
    let sizes = [first.size.length_m / second.size.length_m, first.size.height_m / second.size.height_m];
    let share = gates.least_size_share;
    let forward = |s: &VehicleState| s.world_from_vehicle.transform_vector(&Vector3::x());
    sizes.iter().all(|ratio| (share..=1.0 / share).contains(ratio))
        && forward(from).dot(&forward(to)) >= gates.least_cosine
}

/// Covariance of a state's position in the world.
fn in_world(state: &VehicleState) -> Matrix3<f64> {
    let rotation = state.world_from_vehicle.rotation_matrix();
    rotation * state.covariance.fixed_view::<3, 3>(3, 3) * rotation.transpose()
}

/// True when a vehicle with the boxes of both explains those of each.
fn is_one<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    first: &VehicleTrajectory,
    second: &VehicleTrajectory,
    tracks: &[Track],
) -> bool {
    let boxes = |vehicle: &VehicleTrajectory| tracks.iter().find_map(|track| boxes_of(track, vehicle));
    let Some((earlier, later)) = boxes(first).zip(boxes(second)) else { return false };
    let both = earlier.continued_by(&later);
    let Some(one) = drive.estimate(&both) else { return false };
    let hypothesis = drive.hypothesis();
    let own = drive.explained(overlap, &both, &one, hypothesis.least_box_iou);
    let (of_first, of_second) = own.split_at(earlier.boxes.len());
    most_own(of_first, hypothesis) && most_own(of_second, hypothesis)
}

/// True when no more boxes are foreign to a vehicle than may be by chance.
pub(super) fn most_own(own: &[bool], hypothesis: &HypothesisOptions) -> bool {
    let foreign = own.iter().filter(|own| !**own).count();
    foreign as f64 <= hypothesis.most_foreign_share * own.len() as f64
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::estimate::estimate_track;
    use crate::test_vehicles::{CAMERA, level_grounds, seen_driving};

    fn seen(id: usize, frames: Range<usize>, x_m: f64) -> Track {
        seen_driving(id, frames, x_m, 1.0)
    }

    /// Identities and numbers of states after the join.
    fn joined(tracks: &[Track], longest_gap_s: f64) -> Vec<(usize, usize)> {
        let (grounds, options) = (level_grounds(80), VehicleOptions::default());
        let none = |_: &Track| ExternalTrack::default();
        let estimate = |t: &Track| estimate_track(&CAMERA, &grounds, t, &none(t), &options).unwrap();
        let vehicles: Vec<VehicleTrajectory> = tracks.iter().map(estimate).collect();
        let p: Vec<f64> = vehicles.iter().map(|v| v.p_moving).collect();
        assert!(p.iter().all(|p| *p > 0.9), "{p:?}");
        let found = join_continued((&CAMERA, &grounds), vehicles, tracks, &none, &options, longest_gap_s);
        found.iter().map(|v| (v.id, v.states.len())).collect()
    }

    #[test]
    fn a_moving_car_that_is_seen_again_is_the_same() {
        let (first, second) = (seen(3, 0..15, 0.0), seen(1, 20..40, 0.0));
        assert_eq!(joined(&[first.clone(), second.clone()], 2.0), [(3, 35)]);
        // And once more; its identity is the first one's.
        let third = seen(7, 41..70, 0.0);
        assert_eq!(joined(&[first.clone(), second.clone(), third], 2.0), [(3, 64)]);
        // After too long a gap, in the other lane, beside it all the time, and where another one would be by then.
        assert_eq!(joined(&[first.clone(), second], 0.4), [(1, 20), (3, 15)]);
        assert_eq!(joined(&[first.clone(), seen(1, 20..40, 3.5)], 2.0), [(1, 20), (3, 15)]);
        assert_eq!(joined(&[first.clone(), seen(1, 10..30, 0.0)], 2.0), [(1, 20), (3, 15)]);
        let mut ahead = seen(1, 28..48, 0.0);
        ahead.boxes.iter_mut().for_each(|b| b.frame -= 8);
        assert_eq!(joined(&[first, ahead], 2.0), [(1, 20), (3, 15)]);
    }
}
