//! The object that takes frames.

use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use motorcade_viewer::Pictures;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::drive::NativeDrive;
use crate::errors::{Error, Failure};
use crate::estimate;
use crate::picture;
use crate::run::DetectorArgument;
use crate::running::{MotorcadeArguments, Running};
use crate::supervise::supervised;

/// Takes frames one by one.
#[pyclass(frozen, module = "motorcade._native")]
pub struct NativeMotorcade {
    /// `None` after the end of the drive.
    running: Arc<Mutex<Option<Running>>>,
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
            running.push(frame, number)?;
            Ok(if estimate { running.slam.estimate() } else { None })
        })?;
        now.map(|now| estimate::dictionary(py, &now)).transpose()
    }

    /// Takes a frame that is missing.
    fn skip(&self, py: Python<'_>, time_ns: i64, number: Option<u64>, reason: &str) -> PyResult<()> {
        self.with(py, |running| running.skip(time_ns, number, reason))
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
            Ok(NativeDrive::new(result, context, Pictures::default(), None))
        })
    }
}
