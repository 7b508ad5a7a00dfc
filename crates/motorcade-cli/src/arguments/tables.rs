//! Arguments of `motorcade tables`.

use std::path::PathBuf;

use clap::Args;

/// `motorcade tables`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade tables runs/* --out tables
  motorcade tables runs/monday runs/tuesday --out tables --force

Files: frames/<drive_id>.parquet and tracks/<drive_id>.parquet of every run, drives.parquet with one row a run. Units, descriptions and
frame conventions stand in the metadata of the files. To open all drives at once:
  pandas  pandas.read_parquet('tables/tracks')
  polars  polars.read_parquet('tables/tracks/*.parquet')
  DuckDB  SELECT drive_id, count(DISTINCT id) FROM 'tables/tracks/*.parquet' GROUP BY drive_id")]
pub struct TablesArguments {
    /// Directories of runs; the name of each one is its drive_id.
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// Directory of the tables, new or empty.
    #[arg(long)]
    pub out: PathBuf,
    /// Replace earlier tables in --out; only files that its tables.json lists are removed.
    #[arg(long)]
    pub force: bool,
}
