//! Moving vehicles whose boxes two tracks have in turn.
//!
//! While a vehicle is half hidden a detector may give it a box so unlike those before that a tracker starts a second track on it, until the first one goes
//! on. The second vehicle is seen only where the first one is predicted, and there.

use motorcade_geometry::PinholeCamera;

use super::continued::{alike, most_own};
use super::drive::Drive;
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::observed_box::overlap;
use crate::options::VehicleOptions;
use crate::track::{Track, boxes_of};
use crate::trajectory::{Source, VehicleState, VehicleTrajectory};

/// Makes one vehicle of two that move, of which the second is seen mostly where the first is predicted, in its place, and whose
/// boxes one motion explains. It keeps the identity of the first.
pub fn join_interleaved(
    (camera, grounds): (&PinholeCamera, &[GroundFrame]),
    vehicles: Vec<VehicleTrajectory>,
    tracks: &[Track],
    views: &impl Fn(&Track) -> ExternalTrack,
    options: &VehicleOptions,
) -> Vec<VehicleTrajectory> {
    let drive = Drive { camera, grounds, views, options };
    let mut out = vehicles;
    let mut k = 0;
    while k < out.len() {
        let second = &out[k];
        let fits = |first: &VehicleTrajectory| Some((fills(&drive, first, second)?, first.id));
        let mut firsts: Vec<(f64, usize)> =
            out.iter().filter(|v| v.id != second.id).filter_map(fits).collect();
        firsts.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let place = |id: usize| out.iter().position(|v| v.id == id);
        let one = firsts.into_iter().find_map(|(_, id)| {
            let first = place(id)?;
            Some((first, one_of(&drive, &out[first], second, tracks)?))
        });
        match one {
            Some((first, one)) => {
                out[first] = one;
                out.remove(k);
            }
            None => k += 1,
        }
    }
    out
}

/// Distance of the second vehicle from the first in a gap of the first \[m\]; `None` where they are two. Boxes of halves put it farther aside than its
/// covariance allows.
fn fills<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    first: &VehicleTrajectory,
    second: &VehicleTrajectory,
) -> Option<f64> {
    if !drive.moves(first) || !drive.moves(second) {
        return None;
    }
    let is_seen = |s: &&VehicleState| s.source != Source::Predicted;
    let predicted = |s: &VehicleState| {
        let at = first.states.binary_search_by_key(&s.frame, |s| s.frame).ok()?;
        first.states.get(at).filter(|state| state.source == Source::Predicted)
    };
    let seen = second.states.iter().filter(is_seen);
    let within: Vec<(&VehicleState, &VehicleState)> =
        seen.clone().filter_map(|s| Some((predicted(s)?, s))).collect();
    if within.len() as f64 <= drive.hypothesis().double_share * seen.count() as f64 {
        return None;
    }
    let (there, seen) = within.get(within.len() / 2)?;
    let gates = &drive.options.advanced.met_again;
    if !alike((first, there), (second, seen), gates) {
        return None;
    }
    let apart_m = (seen.world_from_vehicle.translation() - there.world_from_vehicle.translation()).norm();
    // Another vehicle of the lane is farther away than one is long.
    (apart_m <= first.size.length_m.max(second.size.length_m)).then_some(apart_m)
}

/// The vehicle with the boxes of both, those of the first where both have one; `None` where it does not explain those of each.
fn one_of<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    first: &VehicleTrajectory,
    second: &VehicleTrajectory,
    tracks: &[Track],
) -> Option<VehicleTrajectory> {
    let boxes = |vehicle: &VehicleTrajectory| tracks.iter().find_map(|track| boxes_of(track, vehicle));
    let (own, mut others) = (boxes(first)?, boxes(second)?);
    others.boxes.retain(|b| own.boxes.iter().all(|own| own.frame != b.frame));
    let mut both = own.continued_by(&others);
    both.boxes.sort_by_key(|b| b.frame);
    let one = drive.estimate(&both)?;
    let hypothesis = drive.hypothesis();
    let explains =
        |part: &Track| most_own(&drive.explained(overlap, part, &one, hypothesis.least_box_iou), hypothesis);
    (explains(&own) && explains(&others)).then_some(one)
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::estimate::estimate_track;
    use crate::test_vehicles::{CAMERA, level_grounds, seen_driving as seen};

    /// Identities, numbers of states and of those predicted after the join.
    fn joined(tracks: &[Track]) -> Vec<(usize, usize, usize)> {
        let (grounds, options) = (level_grounds(80), VehicleOptions::default());
        let none = |_: &Track| ExternalTrack::default();
        let estimate = |t: &Track| estimate_track(&CAMERA, &grounds, t, &none(t), &options).unwrap();
        let vehicles: Vec<VehicleTrajectory> = tracks.iter().map(estimate).collect();
        let found = join_interleaved((&CAMERA, &grounds), vehicles, tracks, &none, &options);
        let predicted =
            |v: &VehicleTrajectory| v.states.iter().filter(|s| s.source == Source::Predicted).count();
        found.iter().map(|v| (v.id, v.states.len(), predicted(v))).collect()
    }

    fn with_gap(gap: Range<usize>) -> Track {
        seen(3, (0..40).filter(|frame| !gap.contains(frame)), 0.0, 1.0)
    }

    #[test]
    fn boxes_in_the_gap_of_a_moving_car_are_its_own() {
        let second = seen(7, 13..20, 0.0, 1.0);
        assert_eq!(joined(&[with_gap(12..22), second.clone()]), [(3, 40, 3)]);
        assert_eq!(joined(&[second.clone(), with_gap(12..22)]), [(3, 40, 3)]);
        // Of its visible half.
        assert_eq!(joined(&[with_gap(12..22), seen(7, 13..20, 0.0, 0.7)]), [(3, 40, 3)]);
        // Two where both are seen, in the next lane, and where it is seen most of the time.
        assert_eq!(joined(&[with_gap(12..13), second.clone()]).len(), 2);
        assert_eq!(joined(&[with_gap(12..22), seen(7, 13..20, 5.0, 1.0)]).len(), 2);
        assert_eq!(joined(&[with_gap(12..22), seen(7, 0..40, 1.0, 1.0)]).len(), 2);
    }
}
