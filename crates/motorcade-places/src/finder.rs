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

/// Keyframes of a drive with the places among them that were seen again.
#[derive(Clone, Debug)]
pub struct FoundPlaces {
    /// The keyframes; features without a position are left out.
    pub keyframes: Vec<PlacedKeyframe>,
    /// Places seen again, in order of the later visit, at most one earlier visit each.
    pub matches: Vec<PlaceMatch>,
    /// Counts.
    pub report: SearchReport,
}

/// Places seen again in a drive. `may_join(later, earlier, match)` refuses pairs that odometry excludes.
pub fn find_places(
    camera: &PinholeCamera,
    keyframes: Vec<PlacedKeyframe>,
    may_join: impl Fn(&PlacedKeyframe, &PlacedKeyframe, &PlaceMatch) -> bool,
    options: &PlaceOptions,
) -> FoundPlaces {
    let mut search = PlaceSearch::new(*camera, *options);
    keyframes.into_iter().for_each(|keyframe| search.take(keyframe, &may_join));
    search.finish()
}

/// A search that takes the keyframes of a drive one after another.
#[derive(Clone, Debug)]
pub struct PlaceSearch {
    camera: PinholeCamera,
    options: PlaceOptions,
    index: Index,
    keyframes: Vec<PlacedKeyframe>,
    /// Matches that geometry verified.
    verified: Vec<PlaceMatch>,
    report: SearchReport,
}

impl PlaceSearch {
    /// A search without any keyframe.
    pub fn new(camera: PinholeCamera, options: PlaceOptions) -> Self {
        let (keyframes, verified, report) = (Vec::new(), Vec::new(), SearchReport::default());
        Self { camera, options, index: Index::new(options.advanced.search), keyframes, verified, report }
    }

    /// Keyframes so far.
    pub fn keyframes(&self) -> &[PlacedKeyframe] {
        &self.keyframes
    }

    /// Adds a keyframe that others are looked for among, without looking for it.
    pub fn add(&mut self, mut keyframe: PlacedKeyframe) {
        keyframe.forget_unplaced();
        self.keyframes.push(keyframe);
    }

    /// Looks for a keyframe among those that the camera has left, and adds it.
    pub fn take(
        &mut self,
        keyframe: PlacedKeyframe,
        may_join: impl Fn(&PlacedKeyframe, &PlacedKeyframe, &PlaceMatch) -> bool,
    ) {
        // Keyframes enter once the camera has left them, or their map has ended.
        let left = |k: &PlacedKeyframe| {
            k.segment != keyframe.segment
                || keyframe.way_m - k.way_m >= self.options.advanced.search.least_way_m
        };
        while let Some(next) = self.keyframes.get(self.index.len()).filter(|k| left(k)) {
            self.index.push(descriptors(next));
        }
        if self.index.len() > 0 {
            self.report.queries += 1;
            let scores = self.index.scores(descriptors(&keyframe));
            let candidates = best(&scores, keyframe.landmarks.len(), &self.options);
            self.report.candidates += candidates.len();
            let query = (self.keyframes.len(), &keyframe);
            let verified = candidates
                .iter()
                .filter_map(|c| verify(&self.camera, query, (*c, &self.keyframes[*c]), &self.options))
                .filter(|found| may_join(&keyframe, &self.keyframes[found.candidate], found));
            // Of equally good ones the first.
            let best = verified.reduce(|a, b| if b.inliers > a.inliers { b } else { a });
            self.report.verified += usize::from(best.is_some());
            self.verified.extend(best);
        }
        self.add(keyframe);
    }

    /// The matches so far that others along the way agree with.
    pub fn supported(&self) -> Vec<PlaceMatch> {
        supported(&self.keyframes, self.verified.clone(), &self.options.advanced.sequence)
    }

    /// As [`supported`](Self::supported), of keyframes from `first` on alone: those shortly after it lack the others before them.
    pub fn supported_since(&self, first: usize) -> Vec<PlaceMatch> {
        let since = self.verified.partition_point(|m| m.query < first);
        supported(&self.keyframes, self.verified[since..].to_vec(), &self.options.advanced.sequence)
    }

    /// Keyframes so far with a candidate that geometry verified.
    pub fn verified(&self) -> usize {
        self.verified.len()
    }

    /// Counts so far; none of them supported yet.
    pub fn report(&self) -> SearchReport {
        self.report
    }

    /// Ends the search: the matches that others along the way agree with.
    pub fn finish(mut self) -> FoundPlaces {
        let matches = supported(&self.keyframes, self.verified, &self.options.advanced.sequence);
        self.report.supported = matches.len();
        FoundPlaces { keyframes: self.keyframes, matches, report: self.report }
    }
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
    let least = (options.advanced.search.least_score * landmarks as f64) as f32;
    let mut all: Vec<(f32, usize)> = (0..scores.len()).map(|k| (with_neighbours(k), k)).collect();
    all.retain(|(score, _)| *score > least.max(1e-3));
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut chosen: Vec<usize> = Vec::new();
    for (_, k) in all {
        if chosen.len() == options.advanced.search.candidates {
            break;
        }
        // Neighbours of a chosen one say the same.
        if chosen.iter().all(|c| c.abs_diff(k) > 1) {
            chosen.push(k);
        }
    }
    chosen
}
