//! Assignment of boxes to tracks, one to one, best candidates first.

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
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for c in candidates {
        if pairs.iter().all(|(track, detection)| *track != c.track && *detection != c.detection) {
            pairs.push((c.track, c.detection));
        }
    }
    pairs
}

/// Pairs of track and box by overlap with the predicted box: boxes that may start a track first, then weaker ones.
pub(super) fn by_overlap(
    predicted: &[Option<BoundingBox>],
    boxes: &[&Detection],
    options: &TrackerOptions,
) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for confident in [true, false] {
        let mut candidates = Vec::new();
        for (track, expected) in predicted.iter().enumerate() {
            let Some(expected) = expected.filter(|_| pairs.iter().all(|(t, _)| *t != track)) else {
                continue;
            };
            for (detection, found) in boxes.iter().enumerate() {
                let iou = expected.iou(&found.bbox);
                if (found.score >= options.begin_score) == confident && iou >= options.least_iou {
                    candidates.push(Candidate { cost: -iou, track, detection });
                }
            }
        }
        pairs.extend(greedy(candidates));
    }
    pairs
}
