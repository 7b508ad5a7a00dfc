//! A drive as it was estimated.

use std::path::{Path, PathBuf};

use motorcade::output::{Extra, OutputDirectory, RUN_RECORD, frames_csv, io_error, tracks_csv};
use motorcade::{RunContext, RunResult, write_run};
use motorcade_dataset::atomic_file;
use motorcade_vehicles::VehicleTrajectory;
use motorcade_viewer::{Pictures, Report};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::arrays;
use crate::errors::Failure;

/// Name of the file that keeps what perception saw.
pub const PERCEPTION_FILE: &str = "perception.jsonl";

/// Result of a run with what its files need beside it.
#[pyclass(frozen, module = "motorcade._native")]
pub struct NativeDrive {
    result: RunResult,
    context: RunContext,
    pictures: Pictures,
    /// Name and content of a file beside the run's own.
    kept: Option<(&'static str, Vec<u8>)>,
}

impl NativeDrive {
    pub fn new(
        result: RunResult,
        context: RunContext,
        pictures: Pictures,
        kept: Option<(&'static str, Vec<u8>)>,
    ) -> Self {
        Self { result, context, pictures, kept }
    }

    fn extras(&self) -> Vec<Extra> {
        let report = Extra { name: "report.html".into(), content: self.html().into_bytes() };
        let kept =
            self.kept.iter().map(|(name, content)| Extra { name: (*name).into(), content: content.clone() });
        std::iter::once(report).chain(kept).collect()
    }

    fn html(&self) -> String {
        let (result, context, pictures) = (&self.result, &self.context, self.pictures.taken());
        Report { result, context, evaluation: None, pictures }.html()
    }

    fn vehicle<'py>(&self, py: Python<'py>, vehicle: &VehicleTrajectory) -> PyResult<Bound<'py, PyDict>> {
        let (states, out) = (&vehicle.states, PyDict::new(py));
        let (size, sigma) = (vehicle.size, vehicle.size_sigma());
        let three = |d: motorcade_vehicles::Dimensions| [d.length_m, d.width_m, d.height_m];
        out.set_item("id", vehicle.id)?;
        out.set_item("class_name", vehicle.class.name())?;
        out.set_item("size_m", arrays::vector(py, three(size).into_iter()))?;
        out.set_item("size_sigma_m", arrays::vector(py, three(sigma).into_iter()))?;
        out.set_item("p_moving", vehicle.p_moving)?;
        out.set_item("rows", arrays::vector(py, states.iter().map(|s| s.frame as i64)))?;
        out.set_item("poses", arrays::poses(py, states.iter().map(|s| s.world_from_vehicle))?)?;
        out.set_item("covariances", arrays::stacked(py, states.iter().map(|s| s.covariance))?)?;
        let edges = |s: &motorcade_vehicles::VehicleState| s.bbox.map_or([f64::NAN; 4], |b| b.to_array());
        out.set_item("boxes_px", arrays::rows(py, states.iter().map(edges))?)?;
        Ok(out)
    }
}

#[pymethods]
impl NativeDrive {
    /// Arrays of the camera: `numbers`, `times_ns`, `poses`, `covariances`.
    fn camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (out, frames, ego) = (PyDict::new(py), &self.result.frames, &self.result.ego.frames);
        out.set_item("numbers", arrays::vector(py, frames.iter().map(|f| f.number as i64)))?;
        out.set_item("times_ns", arrays::vector(py, frames.iter().map(|f| f.timestamp_ns)))?;
        out.set_item("poses", arrays::poses(py, ego.iter().map(|f| f.world_from_camera))?)?;
        out.set_item("covariances", arrays::stacked(py, ego.iter().map(|f| f.covariance))?)?;
        Ok(out)
    }

    /// Arrays of each vehicle.
    fn vehicles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let vehicles: Vec<_> =
            self.result.vehicles.iter().map(|v| self.vehicle(py, v)).collect::<PyResult<_>>()?;
        PyList::new(py, vehicles)
    }

    /// Facts about the drive: `height_m`, `intrinsics_px`, `size_px`, `length_m`, `tracked_share`, `tracking_failed`, `warnings`.
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (out, result, camera) = (PyDict::new(py), &self.result, &self.result.camera);
        let share = result.tracked_share();
        out.set_item("height_m", result.ego.height_m)?;
        out.set_item("intrinsics_px", (camera.fx, camera.fy, camera.cx, camera.cy))?;
        out.set_item("size_px", (camera.width, camera.height))?;
        out.set_item("length_m", result.ego.length_m())?;
        out.set_item("tracked_share", share)?;
        out.set_item("tracking_failed", 1.0 - share > self.context.config.run.most_untracked)?;
        out.set_item("warnings", &result.warnings)?;
        Ok(out)
    }

    /// Content of `frames.csv`.
    fn frames_csv<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &frames_csv(&self.result))
    }

    /// Content of `tracks.csv`.
    fn tracks_csv<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &tracks_csv(&self.result))
    }

    /// Writes all files of the run, with `parquet` the tables as Parquet too.
    fn save(&self, py: Python<'_>, directory: PathBuf, force: bool, parquet: bool) -> Result<(), Failure> {
        py.detach(|| {
            let place = OutputDirectory::open(&directory, RUN_RECORD, force)?;
            let mut extras = self.extras();
            if parquet {
                extras.extend(motorcade_tables::extras(&self.result, &directory)?);
            }
            Ok(write_run(&place, &self.result, &self.context, &extras)?)
        })
    }

    /// Writes the report.
    fn report(&self, py: Python<'_>, path: PathBuf, force: bool) -> Result<(), Failure> {
        py.detach(|| write_file(&path, self.html().as_bytes(), force))
    }
}

/// Writes a single file, whole or not at all.
///
/// # Errors
/// A file that is there already, unless `force`; a place that cannot be written.
pub fn write_file(path: &Path, content: &[u8], force: bool) -> Result<(), Failure> {
    if !force && path.exists() {
        return Err(Failure::settings(format!("{} exists; --force replaces it", path.display())));
    }
    Ok(atomic_file::write(path, content).map_err(|e| io_error(path, &e))?)
}
