//! Tables as files of the run that they are made of.

use std::path::Path;

use motorcade::RunResult;
use motorcade::output::Extra;

use crate::drive::Drive;
use crate::error::Result;
use crate::run::RunFiles;

/// `frames.parquet` and `tracks.parquet` of a result that goes to the directory `run`, with the values of its `frames.csv`,
/// `ego.tum` and `tracks.csv`.
///
/// # Errors
/// A number that is not finite.
pub fn extras(result: &RunResult, run: &Path) -> Result<Vec<Extra>> {
    let (files, id) = (RunFiles::of(result, run)?, Drive::new(run).id);
    let tables = [files.frames(&id)?, files.tracks(&id)?];
    let extra = |t: &crate::run::RunTable| {
        Ok(Extra { name: format!("{}.parquet", t.table.name), content: t.bytes()? })
    };
    tables.iter().map(extra).collect()
}
