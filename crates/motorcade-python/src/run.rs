//! A drive of files from beginning to end.

use std::path::PathBuf;

use motorcade::{ExternalFiles, Motorcade, RunContext, push_sequence, survey_sequence};
use motorcade_dataset::{ClockOffset, Sequence, SequenceOptions};
use motorcade_perception::{
    DetectorOptions, KeptObservations, ModelOptions, ModelSource, Perception, PerceptionOptions,
};
use motorcade_viewer::Pictures;
use pyo3::prelude::*;

use crate::detector::PythonDetector;
use crate::drive::{NativeDrive, PERCEPTION_FILE};
use crate::errors::Failure;
use crate::settings::SettingsArguments;
use crate::supervise::{Watch, supervised};

/// Arguments of a run as the package hands them over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RunArguments {
    input: PathBuf,
    format: Option<String>,
    sequence: Option<String>,
    camera: Option<u8>,
    calibration: Option<PathBuf>,
    fps: Option<f64>,
    frames: String,
    stride: usize,
    ignore: Option<PathBuf>,
    /// `None` with `height_auto`, and where the input knows it.
    height_m: Option<f64>,
    height_auto: bool,
    models: Option<PathBuf>,
    detections: Option<PathBuf>,
    road_masks: Option<PathBuf>,
    trajectory: Option<PathBuf>,
    metric: bool,
    speed: Option<PathBuf>,
    gps: Option<PathBuf>,
    /// Seconds and their standard deviation.
    clock_offset: Option<(f64, f64)>,
    vehicle_poses: Vec<PathBuf>,
    keypoints: Option<PathBuf>,
    shape_prior: Option<PathBuf>,
    map: Option<PathBuf>,
    keep_perception: bool,
    threads: usize,
    /// The same run on the command line, for the record.
    command: Vec<String>,
    settings: SettingsArguments,
}

/// A detector in Python: a function and its description.
pub type DetectorArgument = Option<(Py<PyAny>, String)>;

/// Runs the pipeline on a drive of files.
#[pyfunction]
#[pyo3(signature = (arguments, detector, progress))]
pub fn run(
    py: Python<'_>,
    arguments: RunArguments,
    detector: DetectorArgument,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<NativeDrive> {
    supervised(py, progress.as_ref(), move |watch| arguments.run(detector, watch))
}

/// Networks by name: a folder, `none`, or those inside the package.
pub fn model_source(models: Option<PathBuf>) -> ModelSource {
    match models {
        Some(path) if path.as_os_str() == "none" => ModelSource::None,
        Some(path) => ModelSource::Folder(path),
        None => ModelSource::Embedded,
    }
}

/// The number of threads asked for; all cores for 0.
pub fn thread_count(asked: usize) -> usize {
    if asked > 0 { asked } else { std::thread::available_parallelism().map_or(1, std::num::NonZero::get) }
}

impl RunArguments {
    fn run(self, detector: DetectorArgument, watch: &Watch) -> Result<NativeDrive, Failure> {
        let config = self.settings.config()?;
        let sequence = Sequence::open(&self.input, &self.sequence_options()?)?;
        if self.height_auto && config.online.enabled {
            return Err(Failure::settings(
                "height_m=\"auto\" is known at the end of a drive only; with online=True give the height in metres",
            ));
        }
        let height_m = if self.height_auto { None } else { Some(sequence.height_m(self.height_m)?) };
        let camera = sequence.camera()?;
        let (perception, kept) = self.perception(&sequence, detector, config.perception)?;
        let context = RunContext {
            config,
            camera_from_cam0: sequence.camera_from_cam0(),
            input: sequence.summary(),
            perception: perception.describe(),
            command: self.command.clone(),
            // Runs are recognised by the command line alone.
            fingerprint: None,
        };
        let numbers: Vec<u64> = sequence.numbers().collect();
        let times: Vec<i64> = sequence.timestamps_ns().collect();
        let external = self.external_files().read(&numbers, &times, &config)?;
        let builder = Motorcade::builder(camera).config(config).external(external).perception(perception);
        let builder = match height_m {
            Some(height_m) => builder.height_m(height_m),
            None => builder.height_by_vehicles(),
        };
        let readout_ms = sequence.calibration().map_or(0.0, |c| c.readout_ms);
        let builder = if readout_ms > 0.0 { builder.readout_s(1e-3 * readout_ms) } else { builder };
        let threads = thread_count(self.threads);
        let mut slam = builder.threads(threads).build()?;
        let mut pictures = Pictures::new(sequence.len());
        let result = if config.online.enabled {
            push_sequence(&mut slam, &sequence, threads, watch, &mut |slam, frame| {
                pictures.push(frame);
                drop(slam.estimate());
            })?;
            slam.finish_online(watch)
        } else {
            survey_sequence(&mut slam, &sequence, watch);
            push_sequence(&mut slam, &sequence, threads, watch, &mut |_, frame| pictures.push(frame))?;
            slam.finish_with(watch)
        };
        let kept = kept.map(|kept| (PERCEPTION_FILE, kept.text().into_bytes()));
        Ok(NativeDrive::new(result, context, pictures, kept))
    }

    fn sequence_options(&self) -> Result<SequenceOptions, Failure> {
        let format = self.format.as_deref().map(str::parse).transpose()?;
        let frames = self.frames.parse().map_err(|e| Failure::settings(format!("frames: {e}")))?;
        Ok(SequenceOptions {
            format,
            sequence: self.sequence.clone(),
            camera: self.camera,
            calibration: self.calibration.clone(),
            fps: self.fps,
            frames,
            stride: self.stride,
            ignore: self.ignore.clone(),
            ..SequenceOptions::default()
        })
    }

    fn external_files(&self) -> ExternalFiles {
        ExternalFiles {
            trajectory: self.trajectory.clone(),
            metric: self.metric,
            speed: self.speed.clone(),
            gps: self.gps.clone(),
            clock_offset: self.clock_offset.map(|(offset_s, sigma_s)| ClockOffset { offset_s, sigma_s }),
            vehicle_poses: self.vehicle_poses.clone(),
            keypoints: self.keypoints.clone(),
            shape_prior: self.shape_prior.clone(),
            map: self.map.clone(),
        }
    }

    fn perception(
        &self,
        sequence: &Sequence,
        detector: DetectorArgument,
        detectors: DetectorOptions,
    ) -> Result<(Perception, Option<KeptObservations>), Failure> {
        let options = PerceptionOptions {
            models: model_source(self.models.clone()),
            detections: self.detections.clone(),
            road_masks: self.road_masks.clone(),
            without_keypoints: self.keypoints.is_some() || !self.vehicle_poses.is_empty(),
            networks: ModelOptions { detectors, ..ModelOptions::default() },
        };
        let mut perception = Perception::open(&options, sequence.size())?;
        if let Some((detect, description)) = detector {
            perception = perception.with_detector(PythonDetector::new(detect, description));
        }
        let kept = self.keep_perception.then(|| perception.keep());
        Ok((perception, kept))
    }
}
