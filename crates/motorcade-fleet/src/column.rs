//! Columns a manifest may have.

/// Kind of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A path; relative ones are relative to the manifest.
    Path,
    /// A path, or this word.
    PathOr(&'static str),
    /// Several paths, separated by `;`.
    Paths,
    /// Several settings `stage.key=value`, separated by `;`.
    Settings,
    /// A number.
    Number,
    /// A number of metres, or the word `auto`.
    Height,
    /// A whole number.
    Whole,
    /// `true` or `false`.
    Flag,
    /// Anything; `motorcade run` checks it.
    Text,
}

/// A column that is an option of `motorcade run`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    /// Name, as in the header.
    pub name: &'static str,
    /// Long name of the option.
    pub option: &'static str,
    /// Kind of its values.
    pub kind: Kind,
}

const fn column(name: &'static str, option: &'static str, kind: Kind) -> Column {
    Column { name, option, kind }
}

const OPTIONS: [Column; 26] = [
    column("calibration", "calibration", Kind::PathOr("auto")),
    column("height", "height", Kind::Height),
    column("speed", "speed", Kind::Path),
    column("gps", "gps", Kind::Path),
    column("clock_offset", "clock-offset", Kind::Text),
    column("sequence", "sequence", Kind::Text),
    column("camera", "camera", Kind::Whole),
    column("frames", "frames", Kind::Text),
    column("stride", "stride", Kind::Whole),
    column("fps", "fps", Kind::Number),
    column("format", "format", Kind::Text),
    column("ignore", "ignore", Kind::Path),
    column("models", "models", Kind::PathOr("none")),
    column("detections", "detections", Kind::Path),
    column("road_masks", "road-masks", Kind::Path),
    column("perception", "perception", Kind::Path),
    column("keep_perception", "keep-perception", Kind::Flag),
    column("parquet", "parquet", Kind::Flag),
    column("trajectory", "trajectory", Kind::Path),
    column("trajectory_scale", "trajectory-scale", Kind::Text),
    column("vehicle_poses", "vehicle-poses", Kind::Paths),
    column("keypoints", "keypoints", Kind::Path),
    column("preset", "preset", Kind::Text),
    column("config", "config", Kind::Path),
    column("seed", "seed", Kind::Whole),
    column("settings", "set", Kind::Settings),
];

/// Columns that are no options; `date` partitions the tables of fleets on Ray.
const OTHERS: [&str; 3] = ["id", "input", "date"];

/// Names of all columns: `id`, `input`, `date` and the options of `motorcade run` that a row may give.
pub const COLUMNS: [&str; OPTIONS.len() + OTHERS.len()] = {
    let mut names = [""; OPTIONS.len() + OTHERS.len()];
    let mut k = 0;
    while k < OTHERS.len() {
        names[k] = OTHERS[k];
        k += 1;
    }
    k = 0;
    while k < OPTIONS.len() {
        names[k + OTHERS.len()] = OPTIONS[k].name;
        k += 1;
    }
    names
};

impl Column {
    /// The option of this name; hyphens are underscores.
    pub(crate) fn find(name: &str) -> Option<Self> {
        let name = name.replace('-', "_");
        OPTIONS.into_iter().find(|column| column.name == name)
    }

    /// True when its values are paths.
    pub(crate) fn is_path(&self) -> bool {
        matches!(self.kind, Kind::Path | Kind::PathOr(_) | Kind::Paths)
    }

    /// Why the value cannot be, where that is known without running anything.
    pub(crate) fn problem(&self, value: &str) -> Option<String> {
        let number = || value.parse::<f64>().is_ok_and(f64::is_finite);
        let (fine, expected) = match self.kind {
            Kind::Number => (number(), "a number"),
            Kind::Height => (value == "auto" || number(), "a number of metres, or `auto`"),
            Kind::Whole => (value.parse::<u64>().is_ok(), "a whole number"),
            Kind::Flag => (matches!(value, "true" | "false"), "`true` or `false`"),
            Kind::Settings => (settings(value).all(|s| s.contains('=')), "stage.key=value, separated by `;`"),
            Kind::Path | Kind::PathOr(_) | Kind::Paths | Kind::Text => (true, ""),
        };
        (!fine).then(|| format!("column `{}`: `{value}` is not {expected}", self.name))
    }
}

/// Parts of a value that holds several.
pub(crate) fn settings(value: &str) -> impl Iterator<Item = &str> {
    value.split(';').map(str::trim).filter(|part| !part.is_empty())
}
