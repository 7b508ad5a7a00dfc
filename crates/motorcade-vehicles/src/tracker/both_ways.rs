//! Association forwards and backwards in time.
//!
//! A vehicle that is passed is known from near first when time runs backwards, one that drives away when it runs forwards. What is known from near is
//! found again far away; the other way round, the boxes of a row of parked vehicles are mistaken for each other.

use std::collections::BTreeMap;

use motorcade_geometry::PinholeCamera;
use motorcade_perception::Detection;

use super::options::TrackerOptions;
use super::{Tracker, linked, track_vehicles};
use crate::ground::GroundFrame;
use crate::options::VehicleOptions;
use crate::track::Track;

/// The tracks of [`track_vehicles`], and those of the same boxes linked backwards in time that differ from them. Boxes may be in two tracks, one a way;
/// [`explain_boxes`](crate::explain_boxes) chooses between their vehicles. Identities are unique.
pub fn track_both_ways(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    detections: &[Vec<Detection>],
    options: &TrackerOptions,
    vehicles: &VehicleOptions,
    stop: &dyn Fn() -> bool,
) -> Vec<Track> {
    let mut tracks = track_vehicles(camera, grounds, detections, options, vehicles, stop);
    let end_s = grounds.last().map_or(0.0, |g| g.time_s);
    let backwards: Vec<GroundFrame> =
        grounds.iter().map(|g| GroundFrame { time_s: end_s - g.time_s, ..*g }).collect();
    let frames = (0..grounds.len().min(detections.len())).rev();
    let mut others =
        linked(Tracker::of_drive(camera, options, vehicles), frames, &backwards, detections, stop);
    others.iter_mut().for_each(|track| track.boxes.reverse());
    let first_frame = |track: &Track| track.boxes.first().map(|b| b.frame);
    let mut known: BTreeMap<Option<usize>, Vec<usize>> = BTreeMap::new();
    for (k, track) in tracks.iter().enumerate() {
        known.entry(first_frame(track)).or_default().push(k);
    }
    others.retain(|other| {
        let same = |k: &usize| tracks[*k].boxes == other.boxes;
        !known.get(&first_frame(other)).is_some_and(|ks| ks.iter().any(same))
    });
    let mut next_id = tracks.iter().map(|track| track.id + 1).max().unwrap_or(1);
    for mut other in others {
        other.id = next_id;
        next_id += 1;
        tracks.push(other);
    }
    tracks
}
