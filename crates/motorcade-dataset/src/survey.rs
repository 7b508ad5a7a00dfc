//! Inventory of an input: files, numbers and times, before any pixel is read.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::format::Format;
use crate::options::SequenceOptions;
use crate::source::images::{Listing, gaps, list, numbering_step};
use crate::source::live::LiveSource;
use crate::source::{Slot, Store, kitti, video};

/// File names beside the frames that are used as their calibration.
const CALIBRATION_NAMES: [&str; 5] =
    ["calibration.toml", "calib.txt", "camera.yaml", "camera_info.yaml", "calibration.yaml"];
/// Frame rate of input without one \[1/s\].
const DEFAULT_FPS: f64 = 10.0;
/// File numbers from here on are times in nanoseconds (after 1973), not counts.
const TIME_NAMES_FROM: u64 = 100_000_000_000_000_000;

#[derive(Clone, Debug)]
pub(crate) struct Survey {
    pub root: PathBuf,
    pub format: Format,
    pub store: Store,
    pub calibration: Option<PathBuf>,
    pub camera: Option<u8>,
    pub sequence: Option<String>,
    pub listing: Listing,
    pub gaps: Vec<u64>,
    pub step: u64,
    /// Times of KITTI's list, or of the packets of a video \[ns\].
    times_ns: Option<Vec<i64>>,
    video_fps: Option<f64>,
    video_frames: u64,
}

pub(crate) fn survey(root: &Path, format: Format, options: &SequenceOptions) -> Result<Survey> {
    let survey = Survey {
        root: root.to_path_buf(),
        format,
        store: Store::Files,
        calibration: options.calibration.clone(),
        camera: options.camera,
        sequence: None,
        listing: Listing::default(),
        gaps: Vec::new(),
        step: 1,
        times_ns: None,
        video_fps: None,
        video_frames: 0,
    };
    let mut survey = found(root, format, options, survey)?;
    if options.uncalibrated {
        survey.calibration = None;
    }
    Ok(survey)
}

/// Files and times of an input.
fn found(root: &Path, format: Format, options: &SequenceOptions, mut survey: Survey) -> Result<Survey> {
    let folder = match format {
        Format::Video => {
            let info = video::probe(root)?;
            survey.store = Store::Video(root.to_path_buf());
            (survey.video_fps, survey.video_frames) = (Some(info.fps), info.frames);
            survey.times_ns = info.times_ns;
            return Ok(survey);
        }
        Format::Live => {
            let source = LiveSource::recognise(root).ok_or_else(|| {
                Error::input(
                    root,
                    "is no live source; expected -, an address such as rtsp://HOST/PATH, or a V4L2 device",
                )
            })?;
            survey.store = Store::Live(source);
            return Ok(survey);
        }
        Format::Images => {
            let beside = CALIBRATION_NAMES.iter().map(|name| root.join(name)).find(|path| path.is_file());
            survey.calibration = survey.calibration.or(beside);
            root.to_path_buf()
        }
        _ => {
            let layout = kitti::layout(root, format, options.sequence.as_deref(), options.camera)?;
            survey.calibration =
                survey.calibration.or(Some(layout.calibration).filter(|path| path.is_file()));
            (survey.camera, survey.sequence) = (Some(layout.camera), layout.sequence);
            survey.times_ns = layout.times.as_deref().map(kitti::read_times).transpose()?;
            layout.images
        }
    };
    survey.listing = list(&folder)?;
    if survey.listing.entries.is_empty() {
        return Err(Error::input(
            &folder,
            "holds no frames; expected numbered image files (PNG, JPEG, WebP, BMP, TIFF)",
        ));
    }
    survey.step = numbering_step(&survey.listing.entries);
    survey.gaps = gaps(&survey.listing.entries, survey.step);
    Ok(survey)
}

impl Survey {
    /// Every frame that should exist, in order, gaps included.
    pub fn slots(&self, given_fps: Option<f64>, calibrated_fps: Option<f64>) -> Result<Vec<Slot>> {
        let fps = given_fps.or(self.video_fps).or(calibrated_fps).unwrap_or(DEFAULT_FPS);
        if let Store::Video(_) = self.store {
            // A rate that was given stands above the times in the file.
            let times = self.times_ns.as_deref().filter(|_| given_fps.is_none());
            let time = |number: u64| match times.and_then(|times| times.get(number as usize)) {
                Some(time) => *time,
                None => (number as f64 * 1e9 / fps).round() as i64,
            };
            return Ok((0..self.video_frames)
                .map(|n| Slot { number: n, timestamp_ns: time(n), path: None })
                .collect());
        }
        let files = self.listing.entries.iter().map(|entry| (entry.number, Some(entry.path.clone())));
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

    /// The frame rate that is taken because nothing tells one \[1/s\]: of pictures alone.
    pub fn assumed_fps(&self, given_fps: Option<f64>, calibrated_fps: Option<f64>) -> Option<f64> {
        let times = self.listing.entries.first().is_some_and(|entry| entry.number >= TIME_NAMES_FROM);
        let told = times || given_fps.or(calibrated_fps).is_some();
        (self.format == Format::Images && !told).then_some(DEFAULT_FPS)
    }

    fn time_ns(&self, number: u64, origin: u64, fps: f64) -> Result<i64> {
        if let Some(times) = &self.times_ns {
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
