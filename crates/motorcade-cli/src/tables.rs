//! `motorcade tables`.

use motorcade::output::OutputDirectory;
use motorcade_tables::{TABLES_RECORD, join, named};

use crate::arguments::TablesArguments;
use crate::drive::command_line;
use crate::exit;

/// Writes the dataset.
pub fn tables(arguments: &TablesArguments) -> anyhow::Result<u8> {
    let drives = named(&arguments.runs)?;
    let directory = OutputDirectory::open(&arguments.out, TABLES_RECORD, arguments.force)?;
    join(&drives, &directory, &command_line())?;
    exit::say(&format!("{} drives\n{}", drives.len(), arguments.out.display()));
    Ok(exit::FINE)
}
