//! Assignment of estimates to labels by overlap of their boxes.

use std::collections::BTreeMap;

use motorcade_dataset::Label;

/// Boxes that overlap less than this are different vehicles.
const MIN_IOU: f64 = 0.5;

/// Objects by frame and identity, in the order of the file.
pub(crate) type ByFrame = BTreeMap<u64, Vec<Label>>;

/// Groups labels by frame; of duplicate identities in a frame the later line counts.
pub(crate) fn by_frame(labels: impl IntoIterator<Item = Label>) -> ByFrame {
    let mut frames = ByFrame::new();
    for label in labels {
        let frame = frames.entry(label.frame).or_default();
        match frame.iter_mut().find(|known| known.track == label.track) {
            Some(known) => *known = label,
            None => frame.push(label),
        }
    }
    frames
}

/// Objects of a frame.
pub(crate) fn in_frame(all: &ByFrame, frame: u64) -> &[Label] {
    all.get(&frame).map_or(&[], Vec::as_slice)
}

/// One-to-one assignment, largest overlap first: index into `estimates` for each of `labels`.
pub(crate) fn assign(labels: &[Label], estimates: &[Label]) -> Vec<Option<usize>> {
    let mut pairs = Vec::new();
    for (i, label) in labels.iter().enumerate() {
        for (j, estimate) in estimates.iter().enumerate() {
            let overlap = label.bbox.iou(&estimate.bbox);
            if overlap >= MIN_IOU {
                pairs.push((overlap, i, j));
            }
        }
    }
    // Stable: equal overlaps keep the order of the files.
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut matched = vec![None; labels.len()];
    let mut used = vec![false; estimates.len()];
    for (_, i, j) in pairs {
        if matched[i].is_none() && !used[j] {
            matched[i] = Some(j);
            used[j] = true;
        }
    }
    matched
}
