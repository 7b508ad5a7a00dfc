//! Settings of a batch.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::shard::Shard;

/// Where a batch goes and how it works.
#[derive(Clone, Debug)]
pub struct Options {
    /// The program whose `run` is called.
    pub program: PathBuf,
    /// Directory of everything that is written.
    pub out: PathBuf,
    /// Drives at a time.
    pub jobs: usize,
    /// Threads of each drive; 0 for as many as a job has cores.
    pub threads: usize,
    /// Bind each job to cores of its own (Linux): `jobs` that share the cores in another way take them from each other.
    pub pin: bool,
    /// The part of the manifest to work on.
    pub shard: Shard,
    /// Bounds of a drive.
    pub limits: Limits,
    /// Further attempts after a failure that may be temporary.
    pub retries: u32,
    /// Pause before the first of them; it doubles with each.
    pub retry_pause: Duration,
    /// Repeat drives that failed for a reason that is not temporary, although neither row nor files have changed.
    pub retry_failed: bool,
}

/// Bounds of one attempt.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Resident memory of the process and those it started \[MB\].
    pub memory_mb: Option<u64>,
    /// Wall-clock time.
    pub timeout: Option<Duration>,
}

impl Options {
    /// Directory of a drive's results.
    pub fn run_directory(&self, id: &str) -> PathBuf {
        self.out.join(RUNS).join(id)
    }

    /// A drive's log.
    pub fn log_file(&self, id: &str) -> PathBuf {
        self.out.join(LOGS).join(format!("{id}.log"))
    }

    /// The file of this shard's attempts.
    pub(crate) fn state_file(&self) -> PathBuf {
        self.out.join(format!("state{}.jsonl", self.shard.suffix()))
    }

    /// The table of this shard.
    pub(crate) fn summary_file(&self, extension: &str) -> PathBuf {
        self.out.join(format!("manifest.done{}.{extension}", self.shard.suffix()))
    }

    pub(crate) fn folders(&self) -> [PathBuf; 2] {
        [RUNS, LOGS].map(|name| Path::new(&self.out).join(name))
    }
}

const RUNS: &str = "runs";
const LOGS: &str = "logs";
