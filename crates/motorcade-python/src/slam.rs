//! The object that takes frames.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use motorcade::{Config, Motorcade, RunContext};
use motorcade_dataset::{Format, Frame, Summary};
use motorcade_geometry::{PinholeCamera, Pose};
use motorcade_perception::{Perception, PerceptionOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::detector::PythonDetector;
use crate::drive::NativeDrive;
use crate::errors::{Error, Failure};
use crate::estimate;
use crate::picture;
use crate::run::{DetectorArgument, model_source, thread_count};
use crate::settings::SettingsArguments;
use crate::supervise::supervised;

/// Takes frames one by one.
#[pyclass(frozen, module = "motorcade._native")]
pub struct NativeMotorcade {
    /// `None` after the end of the drive.
    running: Arc<Mutex<Option<Running>>>,
}

struct Running {
    slam: Motorcade,
    camera: PinholeCamera,
    config: Config,
    perception: (String, String),
    /// Number and time \[ns\] of every frame taken.
    frames: Vec<(u64, i64)>,
    colour: bool,
}

/// Arguments of the object as the package hands them over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct MotorcadeArguments {
    /// fx, fy, cx, cy \[px\].
    intrinsics_px: (f64, f64, f64, f64),
    /// Width and height \[px\].
    size_px: (u32, u32),
    /// `None` where vehicles tell it.
    height_m: Option<f64>,
    models: Option<PathBuf>,
    threads: usize,
    settings: SettingsArguments,
}

impl NativeMotorcade {
    fn lock(&self) -> PyResult<MutexGuard<'_, Option<Running>>> {
        match self.running.try_lock() {
            Ok(guard) => Ok(guard),
            // Waiting could be for ever: a detector that calls its own Motorcade.
            Err(TryLockError::WouldBlock) => Err(Error::new_err("this Motorcade is working on another call")),
            Err(TryLockError::Poisoned(_)) => Err(Error::new_err("this Motorcade failed in an earlier call")),
        }
    }

    /// Works on the running drive without the interpreter's lock.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Running) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| -> PyResult<_> {
            let mut running = self.lock()?;
            let running = running.as_mut().ok_or_else(|| Error::new_err("this drive is finished"))?;
            Ok(work(running)?)
        });
        py.check_signals()?;
        done
    }
}

#[pymethods]
impl NativeMotorcade {
    #[new]
    fn new(py: Python<'_>, arguments: MotorcadeArguments, detector: DetectorArgument) -> PyResult<Self> {
        let running = py.detach(|| arguments.running(detector))?;
        Ok(Self { running: Arc::new(Mutex::new(Some(running))) })
    }

    /// Takes a frame; with `estimate` the estimate of it.
    fn take<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        time_ns: i64,
        number: Option<u64>,
        ignore: Option<&Bound<'py, PyAny>>,
        estimate: bool,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let mut frame = picture::frame(image, time_ns)?;
        frame.ignore = ignore.map(|mask| picture::mask(mask, &frame)).transpose()?;
        let now = self.with(py, move |running| {
            running.number(&mut frame, number)?;
            running.colour |= matches!(frame.pixels, motorcade_dataset::Pixels::Rgb(_));
            running.slam.push(&frame)?;
            running.frames.push((frame.number, frame.timestamp_ns));
            Ok(if estimate { running.slam.estimate() } else { None })
        })?;
        now.map(|now| estimate::dictionary(py, &now)).transpose()
    }

    /// Takes a frame that is missing.
    fn skip(&self, py: Python<'_>, time_ns: i64, number: Option<u64>, reason: &str) -> PyResult<()> {
        self.with(py, |running| {
            let number = running.next_number(number)?;
            running.slam.skip(number, time_ns, reason)?;
            running.frames.push((number, time_ns));
            Ok(())
        })
    }

    /// Rows so far.
    fn __len__(&self) -> PyResult<usize> {
        Ok(self.lock()?.as_ref().map_or(0, |running| running.frames.len()))
    }

    /// Warnings so far.
    fn warnings(&self) -> PyResult<Vec<String>> {
        Ok(self.lock()?.as_ref().map_or_else(Vec::new, |running| running.slam.warnings().to_vec()))
    }

    /// Ends the drive and estimates it as a whole.
    fn finish(
        &self,
        py: Python<'_>,
        command: Vec<String>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<NativeDrive> {
        let taken = self.lock()?.take();
        let running = taken.ok_or_else(|| Error::new_err("this drive is finished"))?;
        supervised(py, progress.as_ref(), move |watch| {
            let context = running.context(command);
            let result = if running.config.online.enabled {
                running.slam.finish_online(watch)
            } else {
                running.slam.finish_with(watch)
            };
            Ok(NativeDrive::new(result, context, None))
        })
    }
}

impl MotorcadeArguments {
    fn running(self, detector: DetectorArgument) -> Result<Running, Failure> {
        let ((fx, fy, cx, cy), (width, height)) = (self.intrinsics_px, self.size_px);
        let camera = PinholeCamera { fx, fy, cx, cy, width, height };
        camera.validate().map_err(|e| Failure::settings(e.to_string()))?;
        let config = self.settings.config()?;
        let options = PerceptionOptions { models: model_source(self.models), ..Default::default() };
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
        let slam = builder.threads(thread_count(self.threads)).build()?;
        Ok(Running { slam, camera, config, perception: words, frames: Vec::new(), colour: false })
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

    fn number(&self, frame: &mut Frame, given: Option<u64>) -> Result<(), Failure> {
        frame.number = self.next_number(given)?;
        frame.index = self.frames.len();
        Ok(())
    }

    fn context(&self, command: Vec<String>) -> RunContext {
        let (frames, camera) = (&self.frames, &self.camera);
        let seconds = |pair: &[(u64, i64)]| (pair[1].1 - pair[0].1) as f64 * 1e-9;
        let mut intervals: Vec<f64> = frames.windows(2).map(seconds).collect();
        intervals.sort_by(f64::total_cmp);
        let at = |k: usize| intervals.get(k).copied().unwrap_or(0.0);
        let (first, last) = (frames.first().copied(), frames.last().copied());
        let input = Summary {
            format: Format::Images,
            sequence: None,
            camera: None,
            frames: frames.len(),
            numbers: (first.map_or(0, |f| f.0), last.map_or(0, |f| f.0)),
            duration_s: first.zip(last).map_or(0.0, |(a, b)| seconds(&[a, b])),
            interval_s: at(intervals.len() / 2),
            intervals_s: (at(0), at(intervals.len().saturating_sub(1))),
            width: camera.width,
            height: camera.height,
            colour: self.colour,
            calibration: Some("in memory"),
            intrinsics_px: Some([camera.fx, camera.fy, camera.cx, camera.cy]),
            distortion: None,
            camera_from_cam0_m: [0.0; 3],
            gaps: Vec::new(),
            duplicates: Vec::new(),
            unnumbered: Vec::new(),
            input_hash: "frames in memory".to_owned(),
        };
        let (config, perception) = (self.config, self.perception.clone());
        let camera_from_cam0 = Pose::identity();
        RunContext { config, camera_from_cam0, input, perception, command, fingerprint: String::new() }
    }
}
