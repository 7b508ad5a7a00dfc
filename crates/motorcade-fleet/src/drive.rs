//! One drive of a manifest.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use crate::column::{COLUMNS, Column, Kind, settings};
use crate::hash::hash;
use crate::id;
use crate::row::Row;

/// A row of the manifest as a `motorcade run` command.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Name of its directory and log, unique in the manifest.
    pub id: String,
    /// Line in the manifest, from 1.
    pub line: u64,
    /// The input, by the manifest's folder.
    pub input: PathBuf,
    /// Options of `motorcade run` and their values as written.
    options: Vec<(Column, String)>,
    /// Folder of the manifest.
    base: PathBuf,
    written_input: String,
}

impl Drive {
    /// The drive of a row, with `defaults` where it has no value of its own; or what is wrong with the row.
    pub(crate) fn new(row: &Row, base: &Path, defaults: &[(Column, String)]) -> Result<Self, String> {
        let (mut id, mut input, mut options) = (None, None, Vec::new());
        for (name, value) in &row.cells {
            if value.contains('\0') {
                return Err(format!("column `{name}`: holds a zero byte"));
            }
            match name.as_str() {
                "id" => id = Some(value.clone()),
                "input" => input = Some(value.clone()),
                "date" => {}
                _ => {
                    let column = Column::find(name).ok_or_else(|| unknown(name))?;
                    column.problem(value).map_or(Ok(()), Err)?;
                    options.push((column, value.clone()));
                }
            }
        }
        let written_input =
            input.ok_or("column `input`: expected a video, a folder of images or a KITTI split")?;
        let of_row: Vec<Column> = options.iter().map(|(column, _)| *column).collect();
        let settings_too = |column: &Column| column.kind == Kind::Settings || !of_row.contains(column);
        // Settings of the row come last: they win.
        options.splice(0..0, defaults.iter().filter(|(column, _)| settings_too(column)).cloned());
        let id = id.unwrap_or_else(|| id::default(&written_input, &options));
        id::check(&id)?;
        Ok(Self {
            id,
            line: row.line,
            input: base.join(&written_input),
            options,
            base: base.to_path_buf(),
            written_input,
        })
    }

    /// Arguments of `motorcade run`, without those of the batch itself.
    pub(crate) fn arguments(&self) -> Vec<OsString> {
        let mut all = Vec::new();
        let mut add = |column: &Column, value: OsString| {
            let mut argument = OsString::from(format!("--{}=", column.option));
            argument.push(value);
            all.push(argument);
        };
        for (column, value) in &self.options {
            match column.kind {
                Kind::Flag => {}
                Kind::Settings => settings(value).for_each(|part| add(column, part.into())),
                _ => self.values(column, value).into_iter().for_each(|v| add(column, v)),
            }
        }
        let flags =
            self.options.iter().filter(|(column, value)| column.kind == Kind::Flag && value == "true");
        all.extend(flags.map(|(column, _)| OsString::from(format!("--{}", column.option))));
        // An input may begin with a hyphen.
        all.extend(["--".into(), self.input.clone().into_os_string()]);
        all
    }

    /// A hash of what the row and the defaults say, as written: a manifest that moves with its files says the same.
    pub(crate) fn row_hash(&self) -> String {
        let options = self.options.iter().flat_map(|(column, value)| [column.name, value.as_str()]);
        hash([env!("CARGO_PKG_VERSION"), self.written_input.as_str()].into_iter().chain(options))
    }

    /// A hash of sizes and times of the files that the row names. Those that are missing count too.
    pub(crate) fn files_hash(&self) -> String {
        let paths = self.options.iter().filter(|(column, _)| column.is_path());
        let paths = paths.flat_map(|(column, value)| self.values(column, value)).map(PathBuf::from);
        let stamps = std::iter::once(self.input.clone()).chain(paths).map(|path| stamp(&path));
        hash(stamps.collect::<Vec<_>>().iter().map(String::as_str))
    }

    /// Values of an option with paths resolved.
    fn values(&self, column: &Column, value: &str) -> Vec<OsString> {
        let resolved = |path: &str| self.base.join(path).into_os_string();
        match column.kind {
            Kind::Path => vec![resolved(value)],
            Kind::PathOr(word) if value != word => vec![resolved(value)],
            Kind::Paths => settings(value).map(resolved).collect(),
            _ => vec![value.into()],
        }
    }
}

fn unknown(name: &str) -> String {
    format!("column `{name}` is not known; columns: {}", COLUMNS.join(", "))
}

fn stamp(path: &Path) -> String {
    let Ok(found) = fs::metadata(path) else { return "missing".to_owned() };
    let time = found.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    format!("{} {}", found.len(), time.map_or(0, |time| time.as_nanos()))
}
