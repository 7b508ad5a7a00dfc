//! Keyframes of places, taken while the camera drives.

use std::io;

use image::GrayImage;
use motorcade_geometry::{Camera, Pose, World};
use motorcade_multibody::LoopOptions;
use motorcade_odometry::{FrameRecord, FrameStatus, OdometryTrajectory};
use motorcade_places::{FeatureExtractor, HiddenParts, PlaceKeyframe};
use nalgebra::{Point2, Vector3};

use crate::archive::StoredList;
use crate::config::Config;

/// Takes a keyframe of places every few metres.
pub(crate) struct PlaceRecorder {
    options: LoopOptions,
    extractor: FeatureExtractor,
    last: Option<Taken>,
    /// Time of the first keyframe of the map \[ns\].
    begun_ns: i64,
    keyframes: Vec<PlaceKeyframe>,
}

/// State of a recorder between two frames.
#[derive(serde::Serialize, serde::Deserialize)]
pub(crate) struct PlaceRecorderState {
    last: Option<Taken>,
    begun_ns: i64,
    keyframes: StoredList,
}

/// The last keyframe; its record of the trajectory may be put away by now.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct Taken {
    timestamp_ns: i64,
    record: FrameRecord,
}

/// A frame that may become a keyframe.
pub(crate) struct Candidate<'a> {
    pub(crate) row: usize,
    pub(crate) timestamp_ns: i64,
    pub(crate) image: &'a GrayImage,
    pub(crate) trajectory: &'a OdometryTrajectory,
    /// The road in the odometry's unit; m with `mᵀX = 1`.
    pub(crate) plane: Option<Vector3<f64>>,
}

impl PlaceRecorder {
    /// For drives with their own odometry; `None` for others.
    pub(crate) fn new(config: &Config, own_odometry: bool) -> Option<Self> {
        let wanted = config.loops.enabled && own_odometry;
        wanted.then(|| Self {
            options: config.loops,
            extractor: FeatureExtractor::new(config.places.features),
            last: None,
            begun_ns: 0,
            keyframes: Vec::new(),
        })
    }

    /// Takes the frame when the camera has moved far enough. Points outside `usable` (vehicles, what is fixed to the camera) are left out.
    pub(crate) fn observe(&mut self, candidate: &Candidate<'_>, usable: impl Fn(&Point2<f64>) -> bool) {
        let Candidate { row, timestamp_ns, image, trajectory, .. } = *candidate;
        let Some(record) = trajectory.frames.get(row).filter(|r| r.status == FrameStatus::Tracked) else {
            return;
        };
        let Some(pose) = trajectory.camera_of(record) else { return };
        if !self.moved(candidate, record, &pose) {
            return;
        }
        if self.last.as_ref().is_none_or(|last| last.record.segment != record.segment) {
            self.begun_ns = timestamp_ns;
        }
        let usable = |x, y| usable(&Point2::new(x, y));
        let features = self.extractor.extract(image, usable);
        let hidden = HiddenParts::of(image.dimensions(), usable);
        self.keyframes.push(PlaceKeyframe { frame: row, segment: record.segment, features, hidden });
        self.last = Some(Taken { timestamp_ns, record: record.clone() });
    }

    fn moved(&self, candidate: &Candidate<'_>, record: &FrameRecord, pose: &Pose<Camera, World>) -> bool {
        let last = self.last.as_ref().filter(|l| l.record.segment == record.segment);
        let Some(last) = last else { return true };
        // By today's pose of the last keyframe: adjustments move it.
        let Some(before) = candidate.trajectory.camera_of(&last.record) else { return true };
        let step = *pose * before.inverse();
        let advanced = &self.options.advanced;
        let since_s = |ns: i64| (candidate.timestamp_ns - ns) as f64 * 1e-9;
        // A new map is to be joined with what is known as soon as it can be.
        let share = if since_s(self.begun_ns) <= advanced.young_s { advanced.young_share } else { 1.0 };
        let far = match candidate.plane {
            // |m| is 1 over the camera's height.
            Some(plane) => step.translation().norm() * plane.norm() >= share * self.options.spacing_heights,
            None => since_s(last.timestamp_ns) >= share * advanced.spacing_s,
        };
        far || step.rotation().angle() >= advanced.spacing_rad
    }

    /// The state after the last frame.
    pub(crate) fn state(&self) -> PlaceRecorderState {
        let Self { options: _, extractor: _, last, begun_ns, keyframes } = self;
        PlaceRecorderState { last: last.clone(), begun_ns: *begun_ns, keyframes: StoredList::of(keyframes) }
    }

    /// As after the frame of a state, with the options of this one.
    ///
    /// # Errors
    /// Keyframes that do not read.
    pub(crate) fn resumed(&self, state: &PlaceRecorderState) -> io::Result<Self> {
        Ok(Self {
            options: self.options,
            extractor: self.extractor.clone(),
            last: state.last.clone(),
            begun_ns: state.begun_ns,
            keyframes: state.keyframes.items()?,
        })
    }

    /// The keyframes so far.
    pub(crate) fn keyframes(&self) -> &[PlaceKeyframe] {
        &self.keyframes
    }

    /// Takes the keyframes out once there are `many`, of drives that need them at the end alone.
    pub(crate) fn take_out(&mut self, many: usize) -> Vec<PlaceKeyframe> {
        if self.keyframes.len() < many { Vec::new() } else { std::mem::take(&mut self.keyframes) }
    }

    /// Puts back the keyframes that were taken out.
    pub(crate) fn put_back(&mut self, older: Vec<PlaceKeyframe>) {
        drop(self.keyframes.splice(..0, older));
    }

    /// Drops the features of the first `count` keyframes.
    pub(crate) fn forget(&mut self, count: usize) {
        // Those before the last one with features have none already.
        let held = self.keyframes.iter_mut().take(count).rev().take_while(|k| !k.features.is_empty());
        held.for_each(|keyframe| (keyframe.features, keyframe.hidden) = Default::default());
    }

    /// Ends the drive.
    pub(crate) fn finish(self) -> Vec<PlaceKeyframe> {
        self.keyframes
    }
}
