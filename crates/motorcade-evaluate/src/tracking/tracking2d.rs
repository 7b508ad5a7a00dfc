//! 2D multi-object tracking of cars by TrackEval's definition: HOTA (Luiten et al., IJCV 2021) and CLEAR metrics.

use std::collections::BTreeMap;

use motorcade_dataset::Label;

use crate::assignment::best_assignment;

use super::frame::{CLASS, TrackingFrame, counts};

/// Overlap of boxes from which a pair is one in CLEAR, and in deciding which estimates do not count.
const MIN_IOU: f64 = 0.5;
/// Overlaps at which HOTA is averaged: 0.05 to 0.95.
const OVERLAPS: usize = 19;
/// Weight in CLEAR of a pair that goes on from the frame before.
const SAME: f64 = 1e3;
/// Rounding of overlaps.
const ROUNDING: f64 = f64::EPSILON;

/// Metrics of boxes in the image \[%\].
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Tracking2dReport {
    /// Labels that count.
    pub labels: usize,
    /// Higher order tracking accuracy, a mean over overlaps from 0.05 to 0.95.
    pub hota: f64,
    /// Its accuracy of detection.
    pub det_a: f64,
    /// Its accuracy of association.
    pub ass_a: f64,
    /// Its accuracy of location: mean overlap of the pairs.
    pub loc_a: f64,
    /// 1 − (missed + wrong + switches) / labels, at an overlap of 0.5.
    pub mota: f64,
    /// Found labels / labels, at an overlap of 0.5.
    pub recall: f64,
    /// Changes of identity, at an overlap of 0.5.
    pub id_switches: usize,
    /// Times that a labelled vehicle is found anew, at an overlap of 0.5.
    pub fragmentations: usize,
}

/// Labels and estimates of a frame that count: their identities, and the overlap of each with each.
struct Counted {
    labels: Vec<i64>,
    estimates: Vec<i64>,
    overlaps: Vec<Vec<f64>>,
}

/// A labelled identity and an estimated one.
type Pair = (i64, i64);

/// Metrics of consecutive frames; `None` when no label counts.
pub(crate) fn evaluate(frames: &[TrackingFrame]) -> Option<Tracking2dReport> {
    let counted: Vec<Counted> = frames.iter().map(Counted::new).collect();
    let labels: usize = counted.iter().map(|frame| frame.labels.len()).sum();
    (labels > 0).then(|| Tracking2dReport { labels, ..hota(&counted, clear(&counted, labels)) })
}

impl Counted {
    /// Labels that count, and estimates that are not those of labels which do not.
    fn new(frame: &TrackingFrame) -> Self {
        let all: Vec<&Label> = frame.estimates.iter().filter(|e| e.class == CLASS).collect();
        let overlaps: Vec<Vec<f64>> =
            frame.truth.iter().map(|l| all.iter().map(|e| l.bbox.iou(&e.bbox)).collect()).collect();
        let near = |o: &f64| if *o >= MIN_IOU - ROUNDING { *o } else { 0.0 };
        let near: Vec<Vec<f64>> = overlaps.iter().map(|row| row.iter().map(near).collect()).collect();
        let mut kept: Vec<bool> = all.iter().map(|estimate| !frame.is_excused(estimate)).collect();
        for (label, assigned) in frame.truth.iter().zip(best_assignment(&near)) {
            if let Some(j) = assigned {
                kept[j] = counts(label);
            }
        }
        let only_kept =
            |row: Vec<f64>| row.into_iter().zip(&kept).filter(|(_, kept)| **kept).map(|(o, _)| o).collect();
        let (labels, overlaps) = frame
            .truth
            .iter()
            .zip(overlaps)
            .filter(|(label, _)| counts(label))
            .map(|(label, row)| (label.track, only_kept(row)))
            .unzip();
        let estimates = all.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(e, _)| e.track).collect();
        Self { labels, estimates, overlaps }
    }

    /// Pairs of the assignment with the largest sum of `weight`(pair, overlap), with their overlap.
    fn pairs(&self, weight: impl Fn(Pair, f64) -> f64) -> Vec<(Pair, f64)> {
        let of_row = |(label, row): (&i64, &Vec<f64>)| -> Vec<f64> {
            self.estimates
                .iter()
                .zip(row)
                .map(|(estimate, overlap)| weight((*label, *estimate), *overlap))
                .collect()
        };
        let weights: Vec<Vec<f64>> = self.labels.iter().zip(&self.overlaps).map(of_row).collect();
        let assigned = best_assignment(&weights).into_iter().enumerate();
        assigned
            .filter_map(|(i, j)| j.map(|j| ((self.labels[i], self.estimates[j]), self.overlaps[i][j])))
            .collect()
    }
}

/// Fills in HOTA and its parts.
fn hota(frames: &[Counted], report: Tracking2dReport) -> Tracking2dReport {
    let (mut of_label, mut of_estimate) = (BTreeMap::<i64, f64>::new(), BTreeMap::<i64, f64>::new());
    let mut likely = BTreeMap::<Pair, f64>::new();
    for frame in frames {
        for label in &frame.labels {
            *of_label.entry(*label).or_default() += 1.0;
        }
        for (j, estimate) in frame.estimates.iter().enumerate() {
            *of_estimate.entry(*estimate).or_default() += 1.0;
            let column: f64 = frame.overlaps.iter().map(|row| row[j]).sum();
            for (label, row) in frame.labels.iter().zip(&frame.overlaps) {
                let either = column + row.iter().sum::<f64>() - row[j];
                if either > ROUNDING {
                    *likely.entry((*label, *estimate)).or_default() += row[j] / either;
                }
            }
        }
    }
    // Frames of either, less those of both.
    let either = |pair: &Pair, both: f64| of_label[&pair.0] + of_estimate[&pair.1] - both;
    let alignment = |pair: Pair| {
        let both = likely.get(&pair).copied().unwrap_or(0.0);
        both / either(&pair, both)
    };
    let mut matched: [BTreeMap<Pair, f64>; OVERLAPS] = Default::default();
    let mut overlap_sums = [0.0; OVERLAPS];
    for frame in frames {
        for (pair, overlap) in frame.pairs(|pair, overlap| alignment(pair) * overlap) {
            for k in (0..OVERLAPS).filter(|k| overlap >= 0.05 * (*k + 1) as f64 - ROUNDING) {
                *matched[k].entry(pair).or_default() += 1.0;
                overlap_sums[k] += overlap;
            }
        }
    }
    let [labels, estimates] = [&of_label, &of_estimate].map(|counts| counts.values().sum::<f64>());
    let mut out = report;
    for (matched, overlap_sum) in matched.iter().zip(overlap_sums) {
        let found: f64 = matched.values().sum();
        let det_a = found / (labels + estimates - found).max(1.0);
        let associated: f64 = matched.iter().map(|(pair, n)| n * n / either(pair, *n).max(1.0)).sum();
        let ass_a = associated / found.max(1.0);
        let share = 100.0 / OVERLAPS as f64;
        out.hota += share * (det_a * ass_a).sqrt();
        out.det_a += share * det_a;
        out.ass_a += share * ass_a;
        out.loc_a += share * if found > 0.0 { overlap_sum / found } else { 1.0 };
    }
    out
}

/// The CLEAR metrics: pairs of the frame before go on where they can.
fn clear(frames: &[Counted], labels: usize) -> Tracking2dReport {
    let mut last_track = BTreeMap::<i64, i64>::new();
    let mut before = BTreeMap::<i64, i64>::new();
    let mut starts = BTreeMap::<i64, usize>::new();
    let (mut found, mut wrong, mut id_switches) = (0, 0, 0);
    for frame in frames {
        // As TrackEval: frames without labels or estimates interrupt nothing.
        if frame.labels.is_empty() || frame.estimates.is_empty() {
            wrong += frame.estimates.len();
            continue;
        }
        let pairs = frame.pairs(|(label, estimate), overlap| match overlap {
            near if near < MIN_IOU - ROUNDING => 0.0,
            near if before.get(&label) == Some(&estimate) => SAME + near,
            near => near,
        });
        found += pairs.len();
        wrong += frame.estimates.len() - pairs.len();
        let now: BTreeMap<i64, i64> = pairs.into_iter().map(|(pair, _)| pair).collect();
        for (label, estimate) in &now {
            id_switches +=
                usize::from(last_track.insert(*label, *estimate).is_some_and(|last| last != *estimate));
            *starts.entry(*label).or_default() += usize::from(!before.contains_key(label));
        }
        before = now;
    }
    let count = labels as f64;
    Tracking2dReport {
        mota: 100.0 * (1.0 - (labels - found + wrong + id_switches) as f64 / count),
        recall: 100.0 * found as f64 / count,
        id_switches,
        fragmentations: starts.values().map(|n| n - 1).sum(),
        ..Tracking2dReport::default()
    }
}
