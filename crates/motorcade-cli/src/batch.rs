//! `motorcade batch`.

mod reporter;

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use motorcade_fleet::{Limits, Manifest, Options, Report, Status};

use self::reporter::BatchReporter;
use crate::arguments::{BatchArguments, CameraHeight};
use crate::exit;
use crate::threads::threads;

/// Pause before the second attempt at a drive.
const RETRY_PAUSE: Duration = Duration::from_secs(2);

/// Runs every drive of a manifest, or of a part of it.
pub fn batch(arguments: &BatchArguments) -> anyhow::Result<u8> {
    let manifest = Manifest::read(&arguments.manifest, &defaults(arguments)?)?;
    let options = Options {
        program: std::env::current_exe().context("cannot find this program's own file")?,
        out: arguments.out.clone(),
        jobs: threads(arguments.jobs),
        threads: arguments.threads,
        pin: !arguments.no_pin,
        shard: arguments.shard,
        limits: Limits {
            memory_mb: arguments.memory_mb,
            timeout: arguments.timeout.map(Duration::from_secs_f64),
        },
        retries: arguments.retries,
        retry_pause: RETRY_PAUSE,
        retry_failed: arguments.retry_failed,
    };
    let reporter = BatchReporter::new(arguments.progress);
    let report = motorcade_fleet::run(&manifest, &options, &reporter)?;
    reporter.finish();
    exit::say(&summary(&report));
    report.tables.iter().for_each(|path| exit::say(&path.display().to_string()));
    Ok(report.exit_code())
}

/// Columns for rows that have none. Paths of the command line are relative to this directory, not to the manifest.
fn defaults(arguments: &BatchArguments) -> anyhow::Result<Vec<(&'static str, String)>> {
    let path = |path: &Path| -> anyhow::Result<String> {
        let full = std::path::absolute(path).with_context(|| format!("cannot use {}", path.display()))?;
        full.into_os_string()
            .into_string()
            .map_err(|name| anyhow::anyhow!("{name:?}: expected a path in UTF-8"))
    };
    let mut all = Vec::new();
    for (name, value) in [("calibration", &arguments.calibration), ("config", &arguments.config)] {
        if let Some(value) = value {
            all.push((name, path(value)?));
        }
    }
    if let Some(models) = &arguments.models {
        let none = models == &PathBuf::from("none");
        all.push(("models", if none { "none".to_owned() } else { path(models)? }));
    }
    if let Some(height) = arguments.height {
        let text = match height {
            CameraHeight::Auto => "auto".to_owned(),
            CameraHeight::Metres(metres) => metres.to_string(),
        };
        all.push(("height", text));
    }
    all.extend(arguments.parquet.then(|| ("parquet", "true".to_owned())));
    if let Some(wrong) = arguments.set.iter().find(|set| !set.contains('=') || set.contains(';')) {
        anyhow::bail!("--set {wrong}: expected stage.key=value without `;`");
    }
    all.extend(arguments.set.iter().map(|set| ("settings", set.clone())));
    Ok(all)
}

fn summary(report: &Report) -> String {
    let named = [
        Status::TrackingFailed,
        Status::Failed,
        Status::TimedOut,
        Status::OutOfMemory,
        Status::Interrupted,
        Status::Pending,
    ];
    let others =
        named.into_iter().map(|status| (status, report.count(status))).filter(|(_, count)| *count > 0);
    let others: String =
        others.map(|(status, count)| format!(", {count} {}", status.name().replace('_', " "))).collect();
    format!("{} of {} drives done{others}", report.count(Status::Done), report.outcomes.len())
}
