//! Calibration files.

use std::path::PathBuf;

use motorcade_dataset::Calibration;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::Failure;

/// A camera as its file describes it.
#[pyfunction]
pub fn read_calibration(
    py: Python<'_>,
    path: PathBuf,
    camera: Option<u8>,
) -> Result<Bound<'_, PyDict>, Failure> {
    let read = Calibration::read(&path, camera)?;
    let (out, size) = (PyDict::new(py), read.size);
    let coefficients: Vec<f64> = read.distortion.coefficients().iter().map(|(_, value)| *value).collect();
    out.set_item("fx", read.fx)?;
    out.set_item("fy", read.fy)?;
    out.set_item("cx", read.cx)?;
    out.set_item("cy", read.cy)?;
    out.set_item("width", size.map(|s| s.0))?;
    out.set_item("height", size.map(|s| s.1))?;
    out.set_item("distortion", PyTuple::new(py, coefficients)?)?;
    out.set_item("model", read.distortion.model())?;
    out.set_item("view_deg", read.view_deg)?;
    out.set_item("fps", read.fps)?;
    out.set_item("height_m", read.height_m)?;
    out.set_item("readout_ms", (read.readout_ms > 0.0).then_some(read.readout_ms))?;
    Ok(out)
}
