//! Many runs as one dataset of Parquet files.

use std::path::PathBuf;

use motorcade::output::OutputDirectory;
use motorcade_tables::{TABLES_RECORD, join, named};
use pyo3::prelude::*;

use crate::errors::Failure;

/// Writes the dataset of the runs of some directories; `command` is for its record.
#[pyfunction]
pub fn tables(
    py: Python<'_>,
    runs: Vec<PathBuf>,
    out: PathBuf,
    force: bool,
    command: Vec<String>,
) -> Result<(), Failure> {
    py.detach(|| {
        let drives = named(&runs)?;
        let directory = OutputDirectory::open(&out, TABLES_RECORD, force)?;
        Ok(join(&drives, &directory, &command)?)
    })
}
