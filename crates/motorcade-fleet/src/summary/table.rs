//! Columns of the table.

use crate::drive::Drive;
use crate::options::Options;
use crate::outcome::Outcome;
use crate::run_record::Results;

/// The columns, all of one length.
pub(super) type Table = Vec<Column>;

/// A column.
pub(super) struct Column {
    /// Name.
    pub name: &'static str,
    /// Unit, empty where there is none.
    #[cfg_attr(not(feature = "parquet"), allow(dead_code, reason = "CSV has names alone"))]
    pub unit: &'static str,
    /// What the values are.
    #[cfg_attr(not(feature = "parquet"), allow(dead_code, reason = "CSV has names alone"))]
    pub description: &'static str,
    /// The values.
    pub values: Values,
}

/// Values of a column.
pub(super) enum Values {
    /// Numbers.
    F64(Vec<Option<f64>>),
    /// Whole numbers.
    I64(Vec<Option<i64>>),
    /// Whole numbers from 0.
    U64(Vec<Option<u64>>),
    /// Text.
    Text(Vec<Option<String>>),
}

impl Values {
    /// Number of values.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::F64(v) => v.len(),
            Self::I64(v) => v.len(),
            Self::U64(v) => v.len(),
            Self::Text(v) => v.len(),
        }
    }
}

/// The table, drives in their order.
pub(super) fn table(drives: &[(&Drive, Outcome)], options: &Options) -> Table {
    let of = |get: &dyn Fn(&Results) -> Option<f64>| {
        Values::F64(drives.iter().map(|(_, o)| o.results.as_ref().and_then(get)).collect())
    };
    let count = |get: &dyn Fn(&Results) -> u64| {
        Values::U64(drives.iter().map(|(_, o)| o.results.as_ref().map(get)).collect())
    };
    let text = |get: &dyn Fn(&Drive, &Outcome) -> Option<String>| {
        Values::Text(drives.iter().map(|(drive, o)| get(drive, o)).collect())
    };
    let number =
        |get: &dyn Fn(&Outcome) -> Option<f64>| Values::F64(drives.iter().map(|(_, o)| get(o)).collect());
    let output = |id: &str| options.run_directory(id).display().to_string();
    let code = drives.iter().map(|(_, o)| o.exit_code.map(i64::from)).collect();
    let attempts = drives.iter().map(|(_, o)| Some(u64::from(o.attempts))).collect();
    let some = |value: String| Some(value).filter(|value| !value.is_empty());
    vec![
        column("id", "", "Name of the drive", text(&|drive, _| Some(drive.id.clone()))),
        column("status", "", "How the drive stands", text(&|_, o| Some(o.status.to_string()))),
        column("exit_code", "", "Exit code of the last attempt; none after a signal", Values::I64(code)),
        column("attempts", "", "Attempts at this row", Values::U64(attempts)),
        column("message", "", "Why there are no results", text(&|_, o| some(o.message.clone()))),
        column(
            "warnings",
            "",
            "Warnings of the run",
            text(&|_, o| some(o.results.as_ref()?.warnings.join(" | "))),
        ),
        column("frames", "", "Frames of the run", count(&|r| r.frames)),
        column("length_m", "m", "Way driven", of(&|r| r.length_m)),
        column("duration_s", "s", "From the first to the last frame", of(&|r| r.duration_s)),
        column("vehicles", "", "Vehicles found", count(&|r| r.vehicles)),
        column("wall_s", "s", "Time of the last attempt", number(&|o| (o.attempts > 0).then_some(o.wall_s))),
        column("cpu_s", "s", "Processor time of the last attempt", number(&|o| o.cpu_s)),
        column("peak_rss_mb", "MB", "Most resident memory of the last attempt", number(&|o| o.peak_rss_mb)),
        column(
            "fingerprint",
            "",
            "Hash of all that decides the results",
            text(&|_, o| Some(o.results.as_ref()?.fingerprint.clone())),
        ),
        column(
            "output",
            "",
            "Directory of the results",
            text(&|drive, o| o.results.as_ref().map(|_| output(&drive.id))),
        ),
    ]
}

fn column(name: &'static str, unit: &'static str, description: &'static str, values: Values) -> Column {
    Column { name, unit, description, values }
}
