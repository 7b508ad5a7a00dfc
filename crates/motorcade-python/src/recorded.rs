//! A run's directory read back.

use std::path::PathBuf;

use motorcade::{RecordedRun, RecordedVehicle};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors::Failure;

/// Reads the tables of a run: `camera` and `vehicles` with the arrays that the tables hold whole.
#[pyfunction]
pub fn read_run(py: Python<'_>, directory: PathBuf) -> Result<Bound<'_, PyDict>, Failure> {
    let run = py.detach(|| RecordedRun::read(&directory))?;
    let (out, camera) = (PyDict::new(py), PyDict::new(py));
    let frames = &run.frames;
    camera.set_item("numbers", arrays::vector(py, frames.iter().map(|f| f.number as i64)))?;
    camera.set_item("times_ns", arrays::vector(py, frames.iter().map(|f| f.timestamp_ns)))?;
    camera.set_item("poses", arrays::poses(py, frames.iter().map(|f| f.world_from_camera))?)?;
    camera.set_item("covariances", arrays::stacked(py, frames.iter().map(|f| f.covariance))?)?;
    out.set_item("camera", camera)?;
    let vehicles: Vec<_> = run.vehicles.iter().map(|v| vehicle(py, v)).collect::<PyResult<_>>()?;
    out.set_item("vehicles", vehicles)?;
    Ok(out)
}

fn vehicle<'py>(py: Python<'py>, vehicle: &RecordedVehicle) -> PyResult<Bound<'py, PyDict>> {
    let (out, states) = (PyDict::new(py), &vehicle.states);
    out.set_item("id", vehicle.id)?;
    out.set_item("class_name", &vehicle.class)?;
    out.set_item("size_m", arrays::vector(py, vehicle.size_m.into_iter()))?;
    out.set_item("p_moving", vehicle.p_moving)?;
    out.set_item("rows", arrays::vector(py, states.iter().map(|s| s.row as i64)))?;
    out.set_item("poses", arrays::poses(py, states.iter().map(|s| s.world_from_vehicle))?)?;
    Ok(out)
}
