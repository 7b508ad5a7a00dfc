//! Many drives: a manifest has a row a drive, and every drive is one `motorcade run` process.
//!
//! Three types to know: [`Manifest`] is the list that was read, [`Options`] say where results go and what bounds a drive, and
//! [`run`] works through the list, or through one [`Shard`] of it, and returns a [`Report`].
//!
//! ```text
//! manifest ─▶ shard ─▶ plan (what the state says is done) ─▶ pool ─▶ job: one process ─▶ state ─▶ summary
//! ```
//!
//! Everything known is in files of the directory: `state*.jsonl` has a line for each attempt that began or ended, `runs/<id>` the
//! results, `logs/<id>.log` what the process said. The log is locked while a process writes to it, so that two batches, or a batch
//! and a process that outlived an earlier one, do not work on one drive at the same time.

mod attempt;
mod batch;
mod column;
mod cores;
mod drive;
mod error;
mod hash;
mod history;
mod id;
mod job;
mod jsonl;
mod log;
mod manifest;
mod monitor;
mod options;
mod outcome;
mod plan;
mod pool;
mod process;
mod retry;
mod row;
mod run_record;
mod shard;
mod state;
mod status;
mod summary;
mod usage;

pub use batch::{Report, run};
pub use column::COLUMNS;
pub use drive::Drive;
pub use error::{Error, Result};
pub use manifest::Manifest;
pub use monitor::{Event, Monitor, Stop};
pub use options::{Limits, Options};
pub use outcome::Outcome;
pub use shard::Shard;
pub use status::Status;
