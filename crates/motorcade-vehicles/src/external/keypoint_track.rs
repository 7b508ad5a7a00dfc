//! Fits of the keypoints of a track, kept while a window moves on.

use std::collections::BTreeMap;

use motorcade_perception::VehicleClass;
use motorcade_shape::{ShapeFit, TrackFit, TrackShape};

use super::frame_keypoints::FrameKeypoints;

/// The keypoints of a track by row of the run, their fits, and the shape that they agree on.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub struct KeypointTrack {
    /// Class that the fits assume.
    pub(super) class: VehicleClass,
    /// Frames before the window of which keypoints are kept.
    pub(super) most_earlier: usize,
    frames: BTreeMap<usize, KnownFrame>,
    /// Of each layout.
    found: [Option<TrackFit>; 2],
    /// First row of the window.
    first: usize,
    /// Frames when the shape was found, and frames added since.
    shape_of: usize,
    since: usize,
}

/// Keypoints of a frame and what was fitted to them; `Some(None)` where the fit failed.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct KnownFrame {
    keypoints: FrameKeypoints,
    fit: Option<Option<ShapeFit>>,
    /// With the opposite heading.
    turned: Option<Option<ShapeFit>>,
}

impl KeypointTrack {
    /// A track of this class without keypoints.
    pub fn new(class: VehicleClass) -> Self {
        Self {
            class,
            most_earlier: usize::MAX,
            frames: BTreeMap::new(),
            found: [None, None],
            first: 0,
            shape_of: 0,
            since: 0,
        }
    }

    /// Moves the window to the rows from `first` on; false when none is left in it. Of those before some are kept, spread over the
    /// track, for its shape.
    pub fn advance(&mut self, first: usize) -> bool {
        self.first = first;
        let earlier: Vec<usize> = self.frames.range(..first).map(|(row, _)| *row).collect();
        if earlier.len() > self.most_earlier {
            for row in earlier.iter().skip(1).step_by(2) {
                self.frames.remove(row);
            }
        }
        self.frames.range(first..).next().is_some()
    }

    /// Adds the keypoints of a row that is not known yet.
    pub(super) fn add(&mut self, row: usize, found: impl FnOnce() -> Option<FrameKeypoints>) {
        if !self.frames.contains_key(&row)
            && let Some(keypoints) = found()
        {
            self.frames.insert(row, KnownFrame { keypoints, fit: None, turned: None });
            self.since += 1;
        }
    }

    /// True when a third more frames are known than when the shape was found, or as many more as it is found on.
    pub(super) fn is_due(&self, shape_frames: usize) -> bool {
        self.since > 0 && self.since >= (self.shape_of / 3).clamp(1, shape_frames.max(1))
    }

    /// Keypoints of a layout, in order of rows.
    pub(super) fn of_layout(&self, layout: usize) -> Vec<&FrameKeypoints> {
        self.frames.values().map(|known| &known.keypoints).filter(|k| k.layout == layout).collect()
    }

    /// Takes the shapes of all known frames. Fits of a shape that came from few frames are dropped.
    pub(super) fn set_shapes(&mut self, found: [Option<TrackFit>; 2], shape_frames: usize) {
        if self.shape_of < shape_frames {
            self.frames.values_mut().for_each(|known| (known.fit, known.turned) = (None, None));
        }
        (self.found, self.shape_of, self.since) = (found, self.frames.len(), 0);
    }

    /// The shape of each layout.
    pub(super) fn shapes(&self) -> [Option<TrackShape>; 2] {
        self.found.each_ref().map(|fit| fit.as_ref().map(|fit| fit.shape))
    }

    /// The fit of the shape: of the first layout that has one.
    pub(super) fn size(&self) -> Option<&TrackFit> {
        self.found.iter().flatten().next()
    }

    /// Fits the frames of the window that were not fitted yet.
    pub(super) fn fit_missing(&mut self, fit: impl Fn(&FrameKeypoints) -> Option<ShapeFit>) {
        for (_, known) in self.frames.range_mut(self.first..) {
            known.fit.get_or_insert_with(|| fit(&known.keypoints));
        }
    }

    /// Fits a row with the opposite heading.
    pub(super) fn turn(
        &mut self,
        row: usize,
        fit: impl FnOnce(&FrameKeypoints, &ShapeFit) -> Option<ShapeFit>,
    ) {
        if let Some(KnownFrame { keypoints, fit: Some(Some(found)), turned }) = self.frames.get_mut(&row) {
            turned.get_or_insert_with(|| fit(keypoints, found));
        }
    }

    /// The fit of a row.
    pub(super) fn fit(&self, row: usize) -> Option<&ShapeFit> {
        self.frames.get(&row)?.fit.as_ref()?.as_ref()
    }

    /// The fit of a row with the opposite heading.
    pub(super) fn turned(&self, row: usize) -> Option<&ShapeFit> {
        self.frames.get(&row)?.turned.as_ref()?.as_ref()
    }
}
