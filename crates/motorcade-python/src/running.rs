//! A drive that is being taken frame by frame.

use std::path::PathBuf;

use motorcade::{Config, Motorcade, RunContext};
use motorcade_dataset::{Fnv, Format, Frame, FrameTimes, Pixels, Summary};
use motorcade_geometry::{PinholeCamera, Pose};
use motorcade_perception::{ModelOptions, Perception, PerceptionOptions};
use pyo3::prelude::*;

use crate::detector::PythonDetector;
use crate::errors::Failure;
use crate::run::{DetectorArgument, model_source, thread_count};
use crate::settings::SettingsArguments;

/// A drive that is being taken frame by frame.
pub struct Running {
    pub slam: Motorcade,
    camera: PinholeCamera,
    pub config: Config,
    perception: (String, String),
    /// Number and time \[ns\] of every frame taken.
    pub frames: Vec<(u64, i64)>,
    /// True once a frame had colour.
    colour: bool,
    /// Hash of numbers, times and pixels so far.
    hash: Fnv,
}

/// Arguments of the object as the package hands them over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct MotorcadeArguments {
    /// fx, fy, cx, cy \[px\].
    intrinsics_px: (f64, f64, f64, f64),
    /// Width and height \[px\].
    size_px: (u32, u32),
    /// `None` where it is estimated from vehicles.
    height_m: Option<f64>,
    /// Of a rolling shutter, where it is stated.
    readout_ms: Option<f64>,
    models: Option<PathBuf>,
    threads: usize,
    settings: SettingsArguments,
}

impl MotorcadeArguments {
    /// The drive before its first frame.
    pub fn running(self, detector: DetectorArgument) -> Result<Running, Failure> {
        let ((fx, fy, cx, cy), (width, height)) = (self.intrinsics_px, self.size_px);
        let camera = PinholeCamera { fx, fy, cx, cy, width, height };
        camera.validate().map_err(|e| Failure::settings(e.to_string()))?;
        let config = self.settings.config()?;
        let networks = ModelOptions { detectors: config.perception, ..ModelOptions::default() };
        let options = PerceptionOptions { models: model_source(self.models), networks, ..Default::default() };
        let mut perception = Perception::open(&options, (width, height))?;
        if let Some((detect, description)) = detector {
            perception = perception.with_detector(PythonDetector::new(detect, description));
        }
        let words = perception.describe();
        let builder = Motorcade::builder(camera).config(config).perception(perception);
        let builder = match self.height_m {
            Some(height_m) => builder.height_m(height_m),
            None => builder.height_by_vehicles(),
        };
        let builder = match self.readout_ms {
            Some(readout_ms) => builder.readout_s(1e-3 * readout_ms),
            None => builder,
        };
        let slam = builder.threads(thread_count(self.threads)).build()?;
        Ok(Running {
            slam,
            camera,
            config,
            perception: words,
            frames: Vec::new(),
            colour: false,
            hash: Fnv::default(),
        })
    }
}

impl Running {
    /// The number given, or one after the last.
    fn next_number(&self, given: Option<u64>) -> Result<u64, Failure> {
        let last = self.frames.last().map(|(number, _)| *number);
        let number = given.unwrap_or_else(|| last.map_or(0, |last| last.saturating_add(1)));
        match last.filter(|last| *last >= number) {
            Some(last) => {
                Err(Failure::input(format!("frame number {number} after {last}; they must increase")))
            }
            None => Ok(number),
        }
    }

    /// Takes a frame under the number given, or one after the last.
    pub fn push(&mut self, mut frame: Frame, number: Option<u64>) -> Result<(), Failure> {
        frame.number = self.next_number(number)?;
        frame.index = self.frames.len();
        self.slam.push(&frame)?;
        self.colour |= matches!(frame.pixels, Pixels::Rgb(_));
        self.note(frame.number, frame.timestamp_ns);
        self.hash.add(match &frame.pixels {
            Pixels::Gray(image) => image.as_raw(),
            Pixels::Rgb(image) => image.as_raw(),
        });
        Ok(())
    }

    fn note(&mut self, number: u64, timestamp_ns: i64) {
        self.frames.push((number, timestamp_ns));
        self.hash.add(&number.to_le_bytes());
        self.hash.add(&timestamp_ns.to_le_bytes());
    }

    /// Takes a frame that is missing.
    pub fn skip(&mut self, time_ns: i64, number: Option<u64>, reason: &str) -> Result<(), Failure> {
        let number = self.next_number(number)?;
        self.slam.skip(number, time_ns, reason)?;
        self.note(number, time_ns);
        Ok(())
    }

    /// Facts about the frames that stand in the outputs.
    pub fn context(&self, command: Vec<String>) -> RunContext {
        let (frames, camera) = (&self.frames, &self.camera);
        let times_ns: Vec<i64> = frames.iter().map(|(_, time_ns)| *time_ns).collect();
        let times = FrameTimes::of(&times_ns);
        let (first, last) = (frames.first().copied(), frames.last().copied());
        let input = Summary {
            format: Format::Images,
            sequence: None,
            camera: None,
            frames: frames.len(),
            numbers: (first.map_or(0, |f| f.0), last.map_or(0, |f| f.0)),
            duration_s: times.duration_s,
            interval_s: times.interval_s,
            intervals_s: times.intervals_s,
            assumed_fps: None,
            width: camera.width,
            height: camera.height,
            colour: self.colour,
            calibration: Some("in memory"),
            intrinsics_px: Some([camera.fx, camera.fy, camera.cx, camera.cy]),
            distortion: None,
            rotation_deg: None,
            lens: None,
            camera_from_cam0_m: [0.0; 3],
            gaps: Vec::new(),
            duplicates: Vec::new(),
            unnumbered: Vec::new(),
            input_hash: self.hash.to_string(),
        };
        let (config, perception) = (self.config, self.perception.clone());
        let camera_from_cam0 = Pose::identity();
        RunContext { config, camera_from_cam0, input, perception, command, fingerprint: None }
    }
}
