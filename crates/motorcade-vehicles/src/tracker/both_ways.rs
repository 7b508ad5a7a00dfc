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
use crate::track::{BoxKey, Track};

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
    let mut known: BTreeMap<BoxKey, usize> = BTreeMap::new();
    for (k, track) in tracks.iter().enumerate() {
        known.extend(track.boxes.first().map(|b| (b.key(), k)));
    }
    others.retain(|other| {
        let same = other.boxes.first().and_then(|b| known.get(&b.key()));
        same.is_none_or(|k| tracks[*k].boxes != other.boxes)
    });
    let next_id = tracks.iter().map(|track| track.id + 1).max().unwrap_or(1);
    tracks.extend((next_id..).zip(others).map(|(id, other)| Track { id, ..other }));
    tracks
}
