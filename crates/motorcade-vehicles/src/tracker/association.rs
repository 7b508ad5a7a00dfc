//! Assignment of boxes to tracks, one to one, best candidates first.

use std::collections::BTreeSet;

use motorcade_perception::{BoundingBox, Detection};

use super::options::TrackerOptions;

/// A candidate pair of track and box with its cost: smaller is better.
pub(super) struct Candidate {
    pub(super) cost: f64,
    pub(super) track: usize,
    pub(super) detection: usize,
}

/// Takes candidates in order of cost, each track and each box at most once; ties go to the lower indices.
pub(super) fn greedy(mut candidates: Vec<Candidate>) -> Vec<(usize, usize)> {
    let index = |c: &Candidate| (c.track, c.detection);
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(index(a).cmp(&index(b))));
    let (mut tracks, mut detections) = (BTreeSet::new(), BTreeSet::new());
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for c in candidates {
        if !tracks.contains(&c.track) && detections.insert(c.detection) {
            tracks.insert(c.track);
            pairs.push((c.track, c.detection));
        }
    }
    pairs
}

/// Pairs of track and box by overlap with the predicted box: boxes that may start a track first, then weaker ones. Where a box
/// is that of several tracks by its overlap, the track of the lowest level gets it, which had such a box most recently (a matching
/// cascade: Wojke et al., DeepSORT, ICIP 2017): one that lives on weak boxes beside a vehicle does not take that vehicle's box. `fits` says of a track and
/// a box whether they may be a pair at all.
pub(super) fn by_overlap(
    predicted: &[Vec<BoundingBox>],
    levels: &[usize],
    boxes: &[&Detection],
    fits: &impl Fn(usize, usize) -> bool,
    options: &TrackerOptions,
) -> Vec<(usize, usize)> {
    let mut cascade = levels.to_vec();
    cascade.sort_unstable();
    cascade.dedup();
    let clear = options.least_iou.max(options.advanced.duplicate_iou);
    let by_level = cascade.into_iter().map(|level| (true, Some(level), clear));
    let all = [(true, None, options.least_iou), (false, None, options.least_iou)];
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (confident, level, least_iou) in by_level.chain(all) {
        // A weak box on a vehicle that has its box is a second box of that vehicle.
        let limit = if confident { 1.0 } else { options.advanced.duplicate_iou };
        let suits = |(detection, found): (usize, &&Detection)| {
            let free = |d: usize| d != detection && boxes[d].bbox.iou(&found.bbox) <= limit;
            (found.score >= options.begin_score) == confident && pairs.iter().all(|(_, d)| free(*d))
        };
        let suits: Vec<bool> = boxes.iter().enumerate().map(suits).collect();
        let mut candidates = Vec::new();
        for (track, expected) in predicted.iter().enumerate() {
            let free = level.is_none_or(|l| levels[track] == l) && pairs.iter().all(|(t, _)| *t != track);
            if !free {
                continue;
            }
            for (detection, found) in boxes.iter().enumerate() {
                if !suits[detection] {
                    continue;
                }
                let iou = expected.iter().map(|b| b.iou(&found.bbox)).fold(0.0, f64::max);
                if iou >= least_iou && fits(track, detection) {
                    candidates.push(Candidate { cost: -iou, track, detection });
                }
            }
        }
        pairs.extend(greedy(candidates));
    }
    pairs
}
