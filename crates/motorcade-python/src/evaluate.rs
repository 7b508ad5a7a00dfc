//! Errors of a run against ground truth.

use std::path::PathBuf;

use motorcade_evaluate::evaluate_run;
use pyo3::prelude::*;

use crate::errors::Failure;

/// Evaluates a run against a KITTI tracking sequence: the errors as JSON and as a table.
#[pyfunction]
pub fn evaluate(
    py: Python<'_>,
    run: PathBuf,
    kitti: PathBuf,
    sequence: String,
    camera: u8,
    first: u64,
) -> Result<(String, String), Failure> {
    let report = py.detach(|| evaluate_run(&run, &kitti, &sequence, camera, first))?;
    let json = serde_json::to_string(&report).map_err(|e| Failure::input(e.to_string()))?;
    Ok((json, report.to_string()))
}
