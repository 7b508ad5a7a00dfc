//! Average precision of 3D boxes by KITTI's rules: 40 recall positions, classes car against car.

use motorcade_dataset::Label;

use crate::cuboid::{Cuboid, Overlap};

/// Class that is evaluated.
const CLASS: &str = "Car";
/// Classes and regions where estimates are not judged.
const IGNORED: [&str; 5] = ["Van", "Truck", "Bus", "Misc", "DontCare"];
/// Recall positions.
const POSITIONS: usize = 40;
/// Overlap of image boxes from which an estimate without a match belongs to a label that does not count.
const IGNORED_IOU: f64 = 0.5;

/// KITTI's difficulties: least height of the box \[px\], most occlusion, most truncation.
struct Difficulty {
    height_px: f64,
    occluded: f64,
    truncated: f64,
}

const DIFFICULTIES: [Difficulty; 3] = [
    Difficulty { height_px: 40.0, occluded: 0.0, truncated: 0.15 },
    Difficulty { height_px: 25.0, occluded: 1.0, truncated: 0.3 },
    Difficulty { height_px: 25.0, occluded: 2.0, truncated: 0.5 },
];

/// AP|R40 \[%\] of cars, for labels of KITTI's difficulties easy, moderate and hard.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct AveragePrecision {
    /// Boxes up to 40 px of height, unoccluded, truncated by at most 15 %.
    pub easy: f64,
    /// Boxes up to 25 px of height, partly occluded, truncated by at most 30 %.
    pub moderate: f64,
    /// Boxes up to 25 px of height, largely occluded, truncated by at most 50 %.
    pub hard: f64,
}

/// Average precision of the 3D boxes of cars.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Boxes3dReport {
    /// Labels that count: easy, moderate, hard.
    pub labels: [usize; 3],
    /// IoU of volumes ≥ 0.5.
    pub ap3d_50: AveragePrecision,
    /// IoU of volumes ≥ 0.7.
    pub ap3d_70: AveragePrecision,
    /// IoU of footprints ≥ 0.5.
    pub bev_50: AveragePrecision,
    /// IoU of footprints ≥ 0.7.
    pub bev_70: AveragePrecision,
}

/// Labels and estimates of a frame with their overlaps.
struct Frame {
    /// Labelled cars.
    cars: Vec<Label>,
    /// Labels of other kinds, whose places are not judged.
    others: Vec<Label>,
    /// Estimated cars, highest score first, with their overlap with each labelled car.
    estimates: Vec<(Label, Vec<Overlap>)>,
}

/// Average precision over frames with labels (of all kinds, boxes in the processed camera) and estimates; `None` when no label counts.
pub(crate) fn evaluate(frames: &[(&[Label], &[Label])]) -> Option<Boxes3dReport> {
    let frames: Vec<Frame> = frames.iter().map(|(labels, estimates)| Frame::new(labels, estimates)).collect();
    let count = |difficulty: &Difficulty| {
        frames.iter().flat_map(|f| &f.cars).filter(|car| difficulty.includes(car)).count()
    };
    let labels = [0, 1, 2].map(|k| count(&DIFFICULTIES[k]));
    let of = |overlap: fn(&Overlap) -> f64, least: f64| {
        let [easy, moderate, hard] =
            [0, 1, 2].map(|k| precision(&frames, &DIFFICULTIES[k], labels[k], overlap, least));
        AveragePrecision { easy, moderate, hard }
    };
    (labels[2] > 0).then(|| Boxes3dReport {
        labels,
        ap3d_50: of(|o| o.volume, 0.5),
        ap3d_70: of(|o| o.volume, 0.7),
        bev_50: of(|o| o.footprint, 0.5),
        bev_70: of(|o| o.footprint, 0.7),
    })
}

impl Difficulty {
    fn includes(&self, label: &Label) -> bool {
        label.bbox.height() > self.height_px
            && label.occluded <= self.occluded
            && label.truncated <= self.truncated
    }
}

impl Frame {
    fn new(labels: &[Label], estimates: &[Label]) -> Self {
        let of = |classes: &[&str]| -> Vec<Label> {
            labels.iter().filter(|label| classes.contains(&label.class.as_str())).cloned().collect()
        };
        let (cars, others) = (of(&[CLASS]), of(&IGNORED));
        let mut estimates: Vec<Label> = estimates.iter().filter(|e| e.class == CLASS).cloned().collect();
        // Stable: equal scores keep the order of the file.
        estimates.sort_by(|a, b| score(b).total_cmp(&score(a)));
        let cuboids: Vec<Cuboid> = cars.iter().map(Cuboid::of).collect();
        let overlaps = |estimate: &Label| {
            let own = Cuboid::of(estimate);
            cuboids.iter().map(|car| own.iou(car)).collect()
        };
        let estimates = estimates.into_iter().map(|e| (overlaps(&e), e)).map(|(o, e)| (e, o)).collect();
        Self { cars, others, estimates }
    }

    /// Score of each estimate that counts, with true for a match.
    fn judge(&self, difficulty: &Difficulty, overlap: fn(&Overlap) -> f64, least: f64) -> Vec<(f64, bool)> {
        let mut used = vec![false; self.cars.len()];
        let mut judged = Vec::new();
        for (estimate, overlaps) in &self.estimates {
            let free = overlaps.iter().enumerate().filter(|(i, _)| !used[*i]);
            // The first of equal overlaps.
            let best = free.map(|(i, o)| (i, overlap(o))).reduce(|a, b| if b.1 > a.1 { b } else { a });
            if let Some((i, _)) = best.filter(|(_, o)| *o >= least) {
                used[i] = true;
                if difficulty.includes(&self.cars[i]) {
                    judged.push((score(estimate), true));
                }
            } else if estimate.bbox.height() >= difficulty.height_px && !self.is_ignored(estimate, difficulty)
            {
                judged.push((score(estimate), false));
            }
        }
        judged
    }

    /// True for an estimate on a label that does not count.
    fn is_ignored(&self, estimate: &Label, difficulty: &Difficulty) -> bool {
        let harder = self.cars.iter().filter(|car| !difficulty.includes(car));
        self.others.iter().chain(harder).any(|l| l.bbox.iou(&estimate.bbox) > IGNORED_IOU)
    }
}

/// Mean over the recall positions of the best precision at that recall or a higher one \[%\].
fn precision(
    frames: &[Frame],
    difficulty: &Difficulty,
    labels: usize,
    overlap: fn(&Overlap) -> f64,
    least: f64,
) -> f64 {
    let mut judged: Vec<(f64, bool)> =
        frames.iter().flat_map(|frame| frame.judge(difficulty, overlap, least)).collect();
    judged.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found = 0;
    let curve: Vec<(f64, f64)> = judged
        .iter()
        .enumerate()
        .map(|(k, (_, matched))| {
            found += usize::from(*matched);
            (found as f64 / labels.max(1) as f64, found as f64 / (k + 1) as f64)
        })
        .collect();
    let at = |position: usize| {
        let recall = position as f64 / POSITIONS as f64;
        curve.iter().filter(|(r, _)| *r >= recall).map(|(_, p)| *p).fold(0.0, f64::max)
    };
    100.0 * (1..=POSITIONS).map(at).sum::<f64>() / POSITIONS as f64
}

fn score(label: &Label) -> f64 {
    label.score.unwrap_or(1.0)
}
