//! Search of a drive for places that are seen again.

use motorcade_geometry::PinholeCamera;

use crate::features::Descriptor;
use crate::index::Index;
use crate::keyframe::PlacedKeyframe;
use crate::options::PlaceOptions;
use crate::sequence::supported;
use crate::verification::{PlaceMatch, verify};

/// Counts of a search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SearchReport {
    /// Keyframes that were looked for among earlier ones.
    pub queries: usize,
    /// Candidates verified by geometry.
    pub candidates: usize,
    /// Keyframes with a candidate that passed.
    pub verified: usize,
    /// Those that agree with others along the way.
    pub supported: usize,
}

/// Places seen again, in order of the later visit, at most one earlier visit each; `may_join(later, earlier)` refuses pairs that odometry
/// excludes.
pub fn find_places(
    camera: &PinholeCamera,
    keyframes: &[PlacedKeyframe],
    may_join: impl Fn(&PlaceMatch) -> bool,
    options: &PlaceOptions,
) -> (Vec<PlaceMatch>, SearchReport) {
    let mut index = Index::new(options.search);
    let (mut report, mut found) = (SearchReport::default(), Vec::new());
    for (query, keyframe) in keyframes.iter().enumerate() {
        // Keyframes enter once the camera has left them, or their map has ended.
        let left = |k: &PlacedKeyframe| {
            k.segment != keyframe.segment || keyframe.way_m - k.way_m >= options.search.least_way_m
        };
        while keyframes[..query].get(index.len()).is_some_and(left) {
            index.push(descriptors(&keyframes[index.len()]));
        }
        if index.len() == 0 {
            continue;
        }
        report.queries += 1;
        let scores = index.scores(descriptors(keyframe));
        let candidates = best(&scores, keyframe.landmarks.len(), options);
        report.candidates += candidates.len();
        let verified = candidates
            .iter()
            .filter_map(|c| verify(camera, (query, keyframe), (*c, &keyframes[*c]), options))
            .filter(&may_join);
        // Of equally good ones the first.
        let best = verified.reduce(|a, b| if b.inliers > a.inliers { b } else { a });
        report.verified += usize::from(best.is_some());
        found.extend(best);
    }
    let found = supported(keyframes, found, &options.sequence);
    report.supported = found.len();
    (found, report)
}

fn descriptors(keyframe: &PlacedKeyframe) -> impl Iterator<Item = Descriptor> {
    let of = |l: &crate::keyframe::Landmark| keyframe.features.get(l.feature as usize).map(|f| f.descriptor);
    keyframe.landmarks.iter().filter_map(of)
}

/// The best keyframes by their own score and that of their neighbours, which see much of the same.
fn best(scores: &[f32], landmarks: usize, options: &PlaceOptions) -> Vec<usize> {
    let with_neighbours = |k: usize| {
        let around = &scores[k.saturating_sub(1)..(k + 2).min(scores.len())];
        around.iter().sum::<f32>()
    };
    let least = (options.search.least_score * landmarks as f64) as f32;
    let mut all: Vec<(f32, usize)> = (0..scores.len()).map(|k| (with_neighbours(k), k)).collect();
    all.retain(|(score, _)| *score > least.max(1e-3));
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut chosen: Vec<usize> = Vec::new();
    for (_, k) in all {
        if chosen.len() == options.search.candidates {
            break;
        }
        // Neighbours of a chosen one say the same.
        if chosen.iter().all(|c| c.abs_diff(k) > 1) {
            chosen.push(k);
        }
    }
    chosen
}
