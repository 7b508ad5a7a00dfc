//! Two standing vehicles whose boxes a tracker joined.
//!
//! A tracker that slips to the neighbour in a row of parked vehicles makes one track that advances by the gap between them, and
//! appears to drive slowly. The boxes before and after the slip stand, each for themselves; those of a vehicle that drives do not.

use super::drive::Drive;
use crate::external::ExternalTrack;
use crate::track::{Track, TrackBox};

/// Shares of a track's boxes after which it is tried to be another vehicle's.
const CUTS: [f64; 3] = [0.35, 0.5, 0.65];

/// The boxes of two standing vehicles in the track of one that seems to drive with `p_moving`; `None` where it does, or where a part
/// does not stand for certain.
pub(super) fn two_standing<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    track: &Track,
    p_moving: f64,
) -> Option<(Vec<TrackBox>, Vec<TrackBox>)> {
    if p_moving <= 0.5 {
        return None;
    }
    let count = track.boxes.len() as f64;
    let standing = |boxes: &[TrackBox]| {
        let found = drive.enough(boxes).then(|| drive.estimate(&track.with_boxes(track.id, boxes.to_vec())));
        found.flatten().map(|found| found.p_moving).filter(|p| *p < drive.hypothesis().most_moving_part)
    };
    let parted = |share: f64| {
        let (early, late) = track.boxes.split_at((share * count).round() as usize);
        Some((standing(early)? + standing(late)?, early.to_vec(), late.to_vec()))
    };
    let best = CUTS.into_iter().filter_map(parted).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, early, late)| (early, late))
}
