//! The table of drives of a dataset.

use std::collections::BTreeSet;

use motorcade::RunRecord;

use crate::run::RunTable;
use crate::table::{Column, Table, Values};

/// Rows of the table, column by column.
#[derive(Default)]
pub(crate) struct Drives {
    ids: Vec<Option<String>>,
    inputs: Vec<Option<String>>,
    formats: Vec<Option<String>>,
    sequences: Vec<Option<String>>,
    frames: Vec<Option<u64>>,
    tracked: Vec<Option<u64>>,
    vehicles: Vec<Option<u64>>,
    durations_s: Vec<Option<f64>>,
    lengths_m: Vec<Option<f64>>,
    heights_m: Vec<Option<f64>>,
    warnings: Vec<Option<u64>>,
    statuses: Vec<Option<String>>,
    versions: Vec<Option<String>>,
}

impl Drives {
    /// Adds a drive.
    pub(crate) fn push(&mut self, id: &str, record: &RunRecord, frames: &RunTable, tracks: &RunTable) {
        let times = &frames.times_ns;
        let duration_ns = times.last().zip(times.first()).map(|(last, first)| last - first);
        let status = record.interrupted.map(|stopped| if stopped { "interrupted" } else { "complete" });
        self.ids.push(Some(id.to_owned()));
        self.inputs.push(input(record));
        self.formats.push(record.input.format.map(|format| format.name().to_owned()));
        self.sequences.push(record.input.sequence.clone());
        self.frames.push(Some(times.len() as u64));
        self.tracked.push(tracked(frames));
        self.vehicles.push(vehicles(tracks));
        self.durations_s.push(duration_ns.map(|ns| ns as f64 / 1e9));
        self.lengths_m.push(record.length_m);
        self.heights_m.push(record.camera_height_m);
        self.warnings.push(Some(record.warnings.len() as u64));
        self.statuses.push(status.map(str::to_owned));
        self.versions.push(record.motorcade.clone());
    }

    /// The table.
    pub(crate) fn table(self) -> Table {
        use Values::{F64, Text, U64};
        let columns = [
            ("drive_id", "", "Identity of the drive", Text(self.ids)),
            ("input", "", "Input as the command of the run names it", Text(self.inputs)),
            ("format", "", "Kind of input", Text(self.formats)),
            ("sequence", "", "Sequence of a KITTI tracking split", Text(self.sequences)),
            ("frames", "", "Number of frames", U64(self.frames)),
            ("frames_tracked", "", "Number of frames whose pose was tracked or stood", U64(self.tracked)),
            ("vehicles", "", "Number of vehicles", U64(self.vehicles)),
            ("duration_s", "s", "From the first to the last frame", F64(self.durations_s)),
            ("length_m", "m", "Way of the camera", F64(self.lengths_m)),
            ("camera_height_m", "m", "Height of the camera above the road", F64(self.heights_m)),
            ("warnings", "", "Number of warnings of the run", U64(self.warnings)),
            ("status", "", "complete, or interrupted before the last frame", Text(self.statuses)),
            ("motorcade", "", "Version of the program that made the run", Text(self.versions)),
        ];
        let column = |(name, unit, description, values): (&str, &str, &str, Values)| Column {
            name: name.into(),
            unit: unit.into(),
            description: description.into(),
            values,
        };
        let columns = columns.into_iter().map(column).collect();
        Table { name: "drives".into(), description: "One row a drive".into(), columns }
    }
}

/// The input, where it is the first argument of `motorcade run`.
fn input(record: &RunRecord) -> Option<String> {
    let [_, command, input, ..] = record.command.as_slice() else { return None };
    (command == "run" && !input.starts_with('-')).then(|| input.clone())
}

fn tracked(frames: &RunTable) -> Option<u64> {
    let Values::Text(statuses) = &frames.table.column("status")?.values else { return None };
    let good = |status: &&Option<String>| matches!(status.as_deref(), Some("tracked" | "standstill"));
    Some(statuses.iter().filter(good).count() as u64)
}

fn vehicles(tracks: &RunTable) -> Option<u64> {
    let Values::U64(ids) = &tracks.table.column("id")?.values else { return None };
    Some(ids.iter().flatten().collect::<BTreeSet<_>>().len() as u64)
}
