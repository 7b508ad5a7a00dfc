//! Vehicles of a drive beside their labels.

use std::collections::BTreeMap;

use motorcade_dataset::Label;

use crate::deviations::VehicleDeviations;
use crate::ego::AlignedTrajectories;
use crate::estimates::Estimates;
use crate::ground_truth::GroundTruth;
use crate::matching::{ByFrame, by_frame, in_frame};
use crate::moving::{Motion, MovingReport};
use crate::vehicles::{VehicleErrors, Vehicles};

/// Estimated vehicles and the ground truth, frames numbered as in the labels.
pub(crate) struct Drive<'a> {
    truth: &'a GroundTruth,
    /// None when the run gives no tracks.
    tracks: Option<ByFrame>,
    /// None when the run gives no deviations.
    deviations: Option<BTreeMap<(u64, i64), VehicleDeviations>>,
    /// Frames of the run.
    frames: u64,
}

impl<'a> Drive<'a> {
    pub(crate) fn new(estimates: &Estimates, truth: &'a GroundTruth) -> Self {
        let tracks = estimates.tracks.as_ref().map(|tracks| {
            let shift = frame_shift(tracks.iter().map(|t| t.frame), truth.first);
            by_frame(tracks.iter().map(|t| Label { frame: t.frame.saturating_add(shift), ..t.clone() }))
        });
        let deviations = estimates.deviations.as_ref().map(|all| {
            let shift = frame_shift(all.iter().map(|d| d.frame), truth.first);
            all.iter().map(|d| ((d.frame.saturating_add(shift), d.id), *d)).collect()
        });
        Self { truth, tracks, deviations, frames: estimates.world_from_camera.len() as u64 }
    }

    /// Errors of the labelled vehicles; `None` without tracks or labels.
    pub(crate) fn vehicles(&self, ego: &AlignedTrajectories) -> Option<VehicleErrors> {
        let labels = self.truth.labels.as_ref()?;
        let vehicles = Vehicles {
            labels,
            boxes: self.truth.moved.as_ref().unwrap_or(labels),
            estimates: self.tracks.as_ref()?,
            deviations: self.deviations.as_ref(),
            camera_from_cam0: self.truth.camera_from_cam0,
            first: self.truth.first,
            fps: self.truth.fps,
        };
        Some(vehicles.evaluate(ego))
    }

    /// Reliability of P(moving); `None` without deviations, tracks or labels.
    pub(crate) fn moving(&self, ego: &AlignedTrajectories) -> Option<MovingReport> {
        let labels = self.truth.labels.as_ref()?;
        let motion = Motion {
            labels,
            boxes: self.truth.moved.as_ref().unwrap_or(labels),
            estimates: self.tracks.as_ref()?,
            world_from_cam0: ego.truth.iter().map(|pose| *pose * self.truth.camera_from_cam0).collect(),
            first: self.truth.first,
            fps: self.truth.fps,
        };
        motion.reliability(self.deviations.as_ref()?.values())
    }

    /// Labels of all kinds and estimates, frame by frame; `None` without tracks, or without labels of the camera.
    pub(crate) fn cars(&self) -> Option<Vec<(&[Label], &[Label])>> {
        let (labels, tracks) = (self.truth.all.as_ref()?, self.tracks.as_ref()?);
        let frames = self.truth.first..self.truth.first + self.frames;
        Some(frames.map(|frame| (in_frame(labels, frame), in_frame(tracks, frame))).collect())
    }
}

/// Number to add to the frames of results for those of the labels: they may be counted from the run's first row.
fn frame_shift(frames: impl Iterator<Item = u64>, first: u64) -> u64 {
    let numbered_by_row = frames.min().is_some_and(|frame| frame < first);
    if numbered_by_row { first } else { 0 }
}
