//! Search of a drive for places that are seen again.

mod state;

use motorcade_geometry::PinholeCamera;

use crate::features::Descriptor;
use crate::index::Index;
use crate::keyframe::PlacedKeyframe;
use crate::keyframes::Keyframes;
use crate::options::PlaceOptions;
use crate::sequence::supported;
use crate::verification::{PlaceMatch, verify};

pub use state::PlaceSearchState;

/// Keyframes before and after a match's one among which the nearest is sought: landmarks are seen well from so many.
const NEIGHBOURS: usize = 3;

/// Counts of a search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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

/// A keyframe as a visit of a place.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
struct Visit {
    /// The first keyframe of the place.
    place: usize,
    /// Its number among the visits of the place, from 1.
    number: usize,
    /// Of the first keyframe: visits so far.
    visits: usize,
}

/// A search that takes the keyframes of a drive one after another.
#[derive(Clone, Debug)]
pub struct PlaceSearch {
    camera: PinholeCamera,
    options: PlaceOptions,
    index: Index,
    keyframes: Keyframes,
    /// Of each keyframe in the index.
    visits: Vec<Visit>,
    /// Keyframes of later visits are not looked for.
    most_visits: usize,
    /// Matches that geometry verified.
    verified: Vec<PlaceMatch>,
    report: SearchReport,
}

impl PlaceSearch {
    /// A search without any keyframe.
    pub fn new(camera: PinholeCamera, options: PlaceOptions) -> Self {
        Self {
            camera,
            options,
            index: Index::new(options.advanced.search),
            keyframes: Keyframes::default(),
            visits: Vec::new(),
            most_visits: usize::MAX,
            verified: Vec::new(),
            report: SearchReport::default(),
        }
    }

    /// Keeps the features of this many visits of a place; keyframes of later ones find those and are not found themselves.
    pub fn keeping_visits(self, most_visits: usize) -> Self {
        Self { most_visits, ..self }
    }

    /// Keyframes so far.
    pub fn keyframes(&self) -> &Keyframes {
        &self.keyframes
    }

    /// True of keyframes that later ones can match, now or once the camera has left them.
    pub fn can_be_found(&self, keyframe: usize) -> bool {
        self.visits.get(keyframe).is_none_or(|visit| visit.number <= self.most_visits)
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
        let least_way_m = self.options.advanced.search.least_way_m;
        let left =
            |k: &PlacedKeyframe| k.segment != keyframe.segment || keyframe.way_m - k.way_m >= least_way_m;
        while self.keyframes.get(self.index.len()).is_some_and(left) {
            self.enter();
        }
        if self.index.len() > 0 {
            let best = self.best(&keyframe, may_join);
            self.report.verified += usize::from(best.is_some());
            self.verified.extend(best);
        }
        self.add(keyframe);
    }

    /// The best match of a keyframe among those that look alike, or with the keyframe next to that one.
    fn best(
        &mut self,
        keyframe: &PlacedKeyframe,
        may_join: impl Fn(&PlacedKeyframe, &PlacedKeyframe, &PlaceMatch) -> bool,
    ) -> Option<PlaceMatch> {
        let scores = self.index.scores(descriptors(keyframe));
        let mut ranked = ranked(&scores, keyframe.landmarks.len(), &self.options);
        ranked.retain(|k| self.can_be_found(*k));
        let candidates = apart(ranked, self.options.advanced.search.candidates);
        self.report.queries += 1;
        self.report.candidates += candidates.len();
        let query = (self.keyframes.len(), keyframe);
        let verified = |candidate: usize| {
            let earlier = &self.keyframes[candidate];
            let found = verify(&self.camera, query, (candidate, earlier), &self.options)?;
            may_join(keyframe, earlier, &found).then_some(found)
        };
        // Of equally good ones the first.
        let better = |a: PlaceMatch, b: PlaceMatch| if b.inliers > a.inliers { b } else { a };
        let found = candidates.into_iter().filter_map(verified).reduce(better)?;
        let nearer = self.nearest(&found).and_then(verified);
        Some(nearer.into_iter().fold(found, better))
    }

    /// The keyframe next to a match's one that lies nearest to where the match has the query, in whose view more of the same is seen; `None` where that is
    /// the match's own.
    fn nearest(&self, found: &PlaceMatch) -> Option<usize> {
        let own = self.keyframes.get(found.candidate)?;
        let there = own.world_from_camera * found.query_from_candidate.inverse();
        let first = found.candidate.saturating_sub(NEIGHBOURS);
        let around = first..(found.candidate + NEIGHBOURS + 1).min(self.index.len());
        let away_m = |k: usize| {
            // Some that cannot be found are taken out.
            let other = self.keyframes.get(k).filter(|o| self.can_be_found(k) && o.segment == own.segment)?;
            Some((k, (other.world_from_camera.translation() - there.translation()).norm()))
        };
        let nearest = around.filter_map(away_m).min_by(|a, b| a.1.total_cmp(&b.1))?.0;
        (nearest != found.candidate).then_some(nearest)
    }

    /// Lets the next keyframe be found, unless its place was visited often enough: it keeps no features then.
    fn enter(&mut self) {
        let k = self.index.len();
        let place = self.known_as(k).and_then(|earlier| self.visits.get(earlier)).map_or(k, |v| v.place);
        self.visits.push(Visit { place, number: 1, visits: 0 });
        self.visits[place].visits += 1;
        self.visits[k].number = self.visits[place].visits;
        if !self.can_be_found(k)
            && let Some(keyframe) = self.keyframes.get_mut(k)
        {
            (keyframe.features, keyframe.landmarks) = (Vec::new(), Vec::new());
        }
        self.index.push(self.keyframes.get(k).into_iter().flat_map(descriptors));
    }

    /// The keyframe of an earlier visit that this one matches, where others along the way agree.
    fn known_as(&self, keyframe: usize) -> Option<usize> {
        let at = self.verified.binary_search_by_key(&keyframe, |m| m.query).ok()?;
        let way_m = self.keyframes.get(keyframe)?.way_m;
        let sequence = &self.options.advanced.sequence;
        let reach_m = sequence.reach_m + sequence.least_join_m;
        let near =
            |m: &&PlaceMatch| self.keyframes.get(m.query).is_some_and(|k| (k.way_m - way_m).abs() <= reach_m);
        let (before, after) = self.verified.split_at(at);
        let first = at - before.iter().rev().take_while(near).count();
        let end = at + after.iter().take_while(near).count();
        let around = supported(&self.keyframes, self.verified[first..end].to_vec(), sequence);
        around.into_iter().find(|m| m.query == keyframe).map(|m| m.candidate)
    }

    /// Takes out what no later keyframe needs: keyframes before `before` that cannot be found, by their numbers, and matches of keyframes before it.
    pub fn take_out(&mut self, before: usize) -> (Vec<(usize, PlacedKeyframe)>, Vec<PlaceMatch>) {
        let found = |k: &usize| self.can_be_found(*k);
        let gone: Vec<usize> = self.keyframes.numbers_before(before).filter(|k| !found(k)).collect();
        let keyframes = self.keyframes.take_out(&gone);
        let old = self.verified.partition_point(|m| m.query < before);
        (keyframes, self.verified.drain(..old).collect())
    }

    /// Puts back all that was taken out, before the end.
    pub fn put_back(&mut self, keyframes: Vec<(usize, PlacedKeyframe)>, matches: Vec<PlaceMatch>) {
        self.keyframes.put_back(keyframes);
        drop(self.verified.splice(..0, matches));
    }

    /// The matches of keyframes from `first` on that others along the way agree with; those shortly after it lack the others before them.
    pub fn supported_since(&self, first: usize) -> Vec<PlaceMatch> {
        let since = self.verified.partition_point(|m| m.query < first);
        supported(&self.keyframes, self.verified[since..].to_vec(), &self.options.advanced.sequence)
    }

    /// Counts so far; none of them supported yet.
    pub fn report(&self) -> SearchReport {
        self.report
    }

    /// Ends the search: the matches that others along the way agree with.
    pub fn finish(mut self) -> FoundPlaces {
        let matches = supported(&self.keyframes, self.verified, &self.options.advanced.sequence);
        self.report.supported = matches.len();
        FoundPlaces { keyframes: self.keyframes.into_vec(), matches, report: self.report }
    }
}

fn descriptors(keyframe: &PlacedKeyframe) -> impl Iterator<Item = Descriptor> {
    let of = |l: &crate::keyframe::Landmark| keyframe.features.get(l.feature as usize).map(|f| f.descriptor);
    keyframe.landmarks.iter().filter_map(of)
}

/// Keyframes that look alike, the best first, by their own score and that of their neighbours, which see much of the same.
fn ranked(scores: &[f32], landmarks: usize, options: &PlaceOptions) -> Vec<usize> {
    let with_neighbours = |k: usize| {
        let around = &scores[k.saturating_sub(1)..(k + 2).min(scores.len())];
        around.iter().sum::<f32>()
    };
    let least = (options.advanced.search.least_score * landmarks as f64) as f32;
    let mut all: Vec<(f32, usize)> = (0..scores.len()).map(|k| (with_neighbours(k), k)).collect();
    all.retain(|(score, _)| *score > least.max(1e-3));
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    all.into_iter().map(|(_, k)| k).collect()
}

/// The first `most` of which none is the neighbour of another: neighbours say the same.
fn apart(ranked: Vec<usize>, most: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::new();
    for k in ranked {
        if chosen.len() == most {
            break;
        }
        if chosen.iter().all(|c| c.abs_diff(k) > 1) {
            chosen.push(k);
        }
    }
    chosen
}
