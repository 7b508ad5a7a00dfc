//! A frame as KITTI's tracking benchmark takes it.

use motorcade_dataset::Label;
use motorcade_geometry::BoundingBox;

/// Class that is evaluated.
pub(super) const CLASS: &str = "Car";
/// Class that is so like it that neither a miss nor a mistake counts there.
const NEIGHBOUR: &str = "Van";
/// Place where nothing is labelled.
const UNLABELLED: &str = "DontCare";
/// Most occluded labels that count: "largely", not "unknown".
const MAX_OCCLUDED: f64 = 2.0;
/// Estimates without a label that are no higher do not count \[px\].
const MIN_HEIGHT_PX: f64 = 25.0;
/// Share of a box within an unlabelled place from which it does not count.
const UNLABELLED_SHARE: f64 = 0.5;

/// Labels and estimates of a frame.
pub(crate) struct TrackingFrame {
    /// Labelled cars and vans.
    pub(super) truth: Vec<Label>,
    /// Estimated cars and vans.
    pub(super) estimates: Vec<Label>,
    unlabelled: Vec<BoundingBox>,
}

impl TrackingFrame {
    /// From labels and estimates of all kinds.
    pub(crate) fn new(labels: &[Label], estimates: &[Label]) -> Self {
        let like_cars = |label: &&Label| [CLASS, NEIGHBOUR].contains(&label.class.as_str());
        Self {
            truth: labels.iter().filter(|label| like_cars(label) && label.track >= 0).cloned().collect(),
            estimates: estimates.iter().filter(like_cars).cloned().collect(),
            unlabelled: labels.iter().filter(|label| label.class == UNLABELLED).map(|l| l.bbox).collect(),
        }
    }

    /// True where an estimate without a label is no mistake: it is too low, or most of it lies where nothing is labelled.
    pub(super) fn is_excused(&self, estimate: &Label) -> bool {
        let inside = |place: &BoundingBox| {
            place.intersection(&estimate.bbox) > UNLABELLED_SHARE * estimate.bbox.area()
        };
        estimate.bbox.height() <= MIN_HEIGHT_PX || self.unlabelled.iter().any(inside)
    }
}

/// True for a label that counts: a car, not truncated and not of unknown occlusion.
pub(super) fn counts(label: &Label) -> bool {
    // The benchmark's labels are whole numbers, and its evaluators read others as such.
    label.class == CLASS && label.occluded.trunc() <= MAX_OCCLUDED && label.truncated.trunc() <= 0.0
}
