//! 3D multi-object tracking of cars by AB3DMOT's definition (Weng et al., IROS 2020): CLEAR metrics over 40 recalls.

use std::collections::BTreeMap;

use crate::assignment::best_assignment;
use crate::cuboid::Cuboid;

use super::frame::{CLASS, TrackingFrame, counts};

/// Recalls at which the metrics are averaged.
const RECALLS: usize = 40;
/// Weight of one more pair against the overlap of pairs: as many pairs as there are come first.
const PAIR: f64 = 1e3;
/// Score of estimates without one.
const NO_SCORE: f64 = -1.0;

/// Metrics at one overlap \[%\]; the averages are over 40 recalls, and zero where the tracks do not reach a recall.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Tracking3d {
    /// Scaled MOTA, averaged: 100 for a tracker that makes no mistake at any recall.
    pub samota: f64,
    /// MOTA, averaged.
    pub amota: f64,
    /// MOTP, averaged.
    pub amotp: f64,
    /// Of the tracks whose scores leave the best MOTA: 1 − (missed + wrong + switches) / labels.
    pub mota: f64,
    /// Of the same tracks: mean overlap of the volumes.
    pub motp: f64,
    /// Of the same tracks: found labels / labels.
    pub recall: f64,
    /// Of the same tracks: changes of the identity from one frame with an estimate to the next.
    pub id_switches: usize,
    /// Of the same tracks: times that a labelled vehicle is found anew or by another track.
    pub fragmentations: usize,
}

/// Metrics of 3D tracking at two overlaps.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Tracking3dReport {
    /// Labels that count.
    pub labels: usize,
    /// IoU of volumes ≥ 0.25.
    pub iou_25: Tracking3d,
    /// IoU of volumes ≥ 0.5.
    pub iou_50: Tracking3d,
}

/// Metrics of consecutive frames; `None` when no label counts.
pub(crate) fn evaluate(frames: &[TrackingFrame]) -> Option<Tracking3dReport> {
    let labels = frames.iter().flat_map(|frame| &frame.truth).filter(|label| counts(label)).count();
    let drive = Drive::new(frames);
    (labels > 0).then(|| Tracking3dReport {
        labels,
        iou_25: drive.over_recalls(0.25),
        iou_50: drive.over_recalls(0.5),
    })
}

/// Frames with the overlap of each label with each estimate, and the mean score of each track.
struct Drive<'a> {
    frames: Vec<(&'a TrackingFrame, Vec<Vec<f64>>)>,
    scores: BTreeMap<i64, f64>,
}

/// Counts over all frames, with the tracks of some least score.
#[derive(Default)]
struct Clear {
    /// Found labels, with those that do not count.
    found: usize,
    /// Sum of their overlaps.
    overlap: f64,
    /// Mean scores of the tracks that found them.
    scores: Vec<f64>,
    missed: usize,
    wrong: usize,
    /// Labels that count.
    labels: usize,
    /// Of each labelled vehicle, frame by frame: the track that found it, and whether it counts there.
    histories: BTreeMap<i64, Vec<(Option<i64>, bool)>>,
}

impl<'a> Drive<'a> {
    fn new(frames: &'a [TrackingFrame]) -> Self {
        let mut of_track: BTreeMap<i64, (f64, usize)> = BTreeMap::new();
        for estimate in frames.iter().flat_map(|frame| &frame.estimates) {
            let (sum, count) = of_track.entry(estimate.track).or_default();
            *sum += estimate.score.unwrap_or(NO_SCORE);
            *count += 1;
        }
        let overlaps = |frame: &TrackingFrame| -> Vec<Vec<f64>> {
            let estimates: Vec<Cuboid> = frame.estimates.iter().map(Cuboid::of).collect();
            let row = |label: Cuboid| estimates.iter().map(|e| label.iou(e).volume).collect();
            frame.truth.iter().map(Cuboid::of).map(row).collect()
        };
        Self {
            frames: frames.iter().map(|frame| (frame, overlaps(frame))).collect(),
            scores: of_track.into_iter().map(|(track, (sum, count))| (track, sum / count as f64)).collect(),
        }
    }

    fn over_recalls(&self, least_overlap: f64) -> Tracking3d {
        let all = self.clear(least_overlap, f64::NEG_INFINITY);
        let mut sums = Tracking3d::default();
        let (mut best, mut chosen) = (0.0, None);
        for (least_score, recall) in thresholds(&all) {
            let clear = self.clear(least_overlap, least_score);
            let mota = clear.mota();
            sums.samota += clear.scaled_mota(recall) / RECALLS as f64;
            sums.amota += mota / RECALLS as f64;
            sums.amotp += clear.motp() / RECALLS as f64;
            if mota > best {
                (best, chosen) = (mota, Some(clear));
            }
        }
        let clear = chosen.unwrap_or(all);
        let (id_switches, fragmentations) = clear.identity_changes();
        Tracking3d {
            mota: clear.mota(),
            motp: clear.motp(),
            recall: 100.0 * clear.found as f64 / (clear.found + clear.missed).max(1) as f64,
            id_switches,
            fragmentations,
            ..sums
        }
    }

    /// Counts with the tracks whose mean score is at least `least_score`.
    fn clear(&self, least_overlap: f64, least_score: f64) -> Clear {
        let mut clear = Clear::default();
        for (frame, overlaps) in &self.frames {
            clear.add(frame, overlaps, least_overlap, |track| {
                self.scores.get(&track).copied().filter(|score| *score >= least_score)
            });
        }
        clear
    }
}

impl Clear {
    /// Adds a frame; `score` is that of a track which takes part.
    fn add(
        &mut self,
        frame: &TrackingFrame,
        overlaps: &[Vec<f64>],
        least_overlap: f64,
        score: impl Fn(i64) -> Option<f64>,
    ) {
        let taking_part = |j: usize| score(frame.estimates[j].track).is_some();
        let estimates: Vec<usize> = (0..frame.estimates.len()).filter(|j| taking_part(*j)).collect();
        let weight = |overlap: f64| if overlap >= least_overlap { PAIR + overlap } else { 0.0 };
        let weights: Vec<Vec<f64>> =
            overlaps.iter().map(|row| estimates.iter().map(|j| weight(row[*j])).collect()).collect();
        let mut matched = vec![false; estimates.len()];
        for (i, assigned) in best_assignment(&weights).into_iter().enumerate() {
            let label = &frame.truth[i];
            self.labels += usize::from(counts(label));
            let track = assigned.map(|k| {
                let estimate = estimates[k];
                let track = frame.estimates[estimate].track;
                matched[k] = true;
                self.found += 1;
                self.overlap += overlaps[i][estimate];
                self.scores.extend(score(track));
                track
            });
            self.missed += usize::from(track.is_none() && counts(label));
            self.histories.entry(label.track).or_default().push((track, counts(label)));
        }
        let alone = estimates.iter().zip(matched).filter(|(_, matched)| !matched);
        let mistaken =
            alone.map(|(j, _)| &frame.estimates[*j]).filter(|e| e.class == CLASS && !frame.is_excused(e));
        self.wrong += mistaken.count();
    }

    /// Changes of identity, and fragmentations.
    fn identity_changes(&self) -> (usize, usize) {
        let of_vehicles = self.histories.values().map(|history| changes(history));
        of_vehicles.fold((0, 0), |(a, b), (x, y)| (a + x, b + y))
    }

    fn mota(&self) -> f64 {
        let mistakes = self.missed + self.wrong + self.identity_changes().0;
        100.0 * (1.0 - mistakes as f64 / self.labels as f64)
    }

    /// MOTA of which 1 − recall of the labels may be missed.
    fn scaled_mota(&self, recall: f64) -> f64 {
        let mistakes = (self.missed + self.wrong + self.identity_changes().0) as f64;
        let labels = self.labels as f64;
        100.0 * (1.0 - (mistakes - (1.0 - recall) * labels) / (recall * labels)).clamp(0.0, 1.0)
    }

    fn motp(&self) -> f64 {
        100.0 * self.overlap / self.found.max(1) as f64
    }
}

/// Changes of identity and fragmentations of one labelled vehicle, frame by frame: the track that found it, and whether it counts there.
fn changes(history: &[(Option<i64>, bool)]) -> (usize, usize) {
    let (mut switches, mut fragmentations) = (0, 0);
    let mut last = history[0].0;
    for (k, window) in history.windows(2).enumerate() {
        let [(before, _), (track, counted)] = [window[0], window[1]];
        if !counted {
            last = None;
            continue;
        }
        if track.is_some() {
            let known = last.is_some();
            switches += usize::from(known && before.is_some() && last != track);
            // The definition's own exceptions: a single frame between two misses is none, and the last frame is one even where nothing was before.
            let goes_on = history.get(k + 2).is_none_or(|(next, _)| known && next.is_some());
            fragmentations += usize::from(before != track && goes_on);
        }
        last = track.or(last);
    }
    (switches, fragmentations)
}

/// Least scores at which the tracks reach recalls of 1/40, 2/40, … of the labels, with these recalls.
fn thresholds(all: &Clear) -> Vec<(f64, f64)> {
    let mut scores = all.scores.clone();
    scores.sort_by(|a, b| b.total_cmp(a));
    let labels = (all.found + all.missed) as f64;
    let mut found = Vec::new();
    let mut recall = 0.0;
    for (k, score) in scores.iter().enumerate() {
        let last = k + 1 == scores.len();
        let [here, next] = [1.0, 2.0].map(|more| (k as f64 + more) / labels);
        // The score whose recall is nearest.
        if !last && next - recall < recall - here {
            continue;
        }
        found.push((*score, recall));
        recall += 1.0 / RECALLS as f64;
    }
    // Recall 0 tells nothing.
    found.split_off(1.min(found.len()))
}
