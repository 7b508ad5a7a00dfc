//! Columns of the table.

use motorcade_tables::{Column, Table, Values};

use crate::drive::Drive;
use crate::options::Options;
use crate::outcome::Outcome;
use crate::run_record::Results;

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
    let columns = vec![
        column("id", "", "Name of the drive", text(&|drive, _| Some(drive.id.clone()))),
        column("status", "", "Status of the drive", text(&|_, o| Some(o.status.to_string()))),
        column("exit_code", "", "Exit code of the last attempt; none after a signal", Values::I64(code)),
        column("attempts", "", "Attempts at this row", Values::U64(attempts)),
        column("message", "", "Reason why there are no results", text(&|_, o| some(o.message.clone()))),
        column(
            "warnings",
            "",
            "Warnings of the run",
            text(&|_, o| some(o.results.as_ref()?.warnings.join(" | "))),
        ),
        column("frames", "", "Frames of the run", count(&|r| r.frames)),
        column("length_m", "m", "Distance driven", of(&|r| r.length_m)),
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
    ];
    Table { name: "drives".into(), description: "One row a drive of a batch".into(), columns }
}

fn column(name: &str, unit: &str, description: &str, values: Values) -> Column {
    Column { name: name.into(), unit: unit.into(), description: description.into(), values }
}
