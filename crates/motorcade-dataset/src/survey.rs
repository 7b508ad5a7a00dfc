//! Inventory of an input: files, numbers and times, before any pixel is read.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::options::SequenceOptions;
use crate::source::listing::{gaps, numbering_step};
use crate::source::{Choice, Contents, Format, Slot, Store};

/// Frame rate of input without one \[1/s\].
const DEFAULT_FPS: f64 = 10.0;
/// File numbers from here on are times in nanoseconds (after 1973), not counts.
const TIME_NAMES_FROM: u64 = 100_000_000_000_000_000;

#[derive(Clone, Debug)]
pub(crate) struct Survey {
    pub root: PathBuf,
    pub format: Format,
    pub contents: Contents,
    /// The calibration file that is used.
    pub calibration: Option<PathBuf>,
    pub gaps: Vec<u64>,
    pub step: u64,
}

pub(crate) fn survey(root: &Path, format: Format, options: &SequenceOptions) -> Result<Survey> {
    let choice = Choice { sequence: options.sequence.as_deref(), camera: options.camera };
    let contents = format.layout().contents(root, choice)?;
    let calibration = options.calibration.clone().or_else(|| contents.calibration.clone());
    let entries = &contents.listing.entries;
    let step = numbering_step(entries);
    Ok(Survey {
        root: root.to_path_buf(),
        format,
        calibration: calibration.filter(|_| !options.uncalibrated),
        gaps: gaps(entries, step),
        step,
        contents,
    })
}

impl Survey {
    /// Every frame that should exist, in order, gaps included.
    pub fn slots(&self, given_fps: Option<f64>, calibrated_fps: Option<f64>) -> Result<Vec<Slot>> {
        let fps = given_fps.or(self.contents.video_fps).or(calibrated_fps).unwrap_or(DEFAULT_FPS);
        if let Store::Video(_) = self.contents.store {
            // A rate that was given stands above the times in the file.
            let times = self.contents.times_ns.as_deref().filter(|_| given_fps.is_none());
            let time = |number: u64| match times.and_then(|times| times.get(number as usize)) {
                Some(time) => *time,
                None => (number as f64 * 1e9 / fps).round() as i64,
            };
            return Ok((0..self.contents.video_frames)
                .map(|n| Slot { number: n, timestamp_ns: time(n), path: None })
                .collect());
        }
        let files =
            self.contents.listing.entries.iter().map(|entry| (entry.number, Some(entry.path.clone())));
        let mut all: Vec<(u64, Option<PathBuf>)> =
            files.chain(self.gaps.iter().map(|n| (*n, None))).collect();
        all.sort_by_key(|(number, _)| *number);
        // KITTI counts from the start of its recording; elsewhere the first file is the start.
        let origin = if self.format.is_kitti() { 0 } else { all.first().map_or(0, |(number, _)| *number) };
        let slot = |(number, path): (u64, Option<PathBuf>)| {
            let timestamp_ns = self.time_ns(number, origin, fps)?;
            Ok(Slot { number, timestamp_ns, path })
        };
        all.into_iter().map(slot).collect()
    }

    /// The frame rate that is taken because none is given \[1/s\]: of pictures alone.
    pub fn assumed_fps(&self, given_fps: Option<f64>, calibrated_fps: Option<f64>) -> Option<f64> {
        let times =
            self.contents.listing.entries.first().is_some_and(|entry| entry.number >= TIME_NAMES_FROM);
        let known = times || given_fps.or(calibrated_fps).is_some();
        (!self.contents.listing.entries.is_empty()
            && self.contents.times_ns.is_none()
            && !self.format.is_kitti()
            && !known)
            .then_some(DEFAULT_FPS)
    }

    fn time_ns(&self, number: u64, origin: u64, fps: f64) -> Result<i64> {
        if let Some(times) = &self.contents.times_ns {
            return times.get(number as usize).copied().ok_or_else(|| {
                Error::input(&self.root, format!("has {} times but a frame {number}", times.len()))
            });
        }
        if origin >= TIME_NAMES_FROM {
            return i64::try_from(number)
                .map_err(|_| Error::input(&self.root, format!("frame number {number} is too large")));
        }
        Ok((((number - origin) / self.step) as f64 * 1e9 / fps).round() as i64)
    }
}
