//! Single files a command writes.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use motorcade::output::io_error;
use motorcade_dataset::atomic_file::PendingFile;
use serde::Serializer;
use serde_json::{Map, Value};

use crate::interruption;

/// Kind of content of an output file. An earlier file of the same kind is replaced; one of another kind is the user's, an input for instance.
#[derive(Clone, Copy, Debug)]
pub enum Content {
    Evaluation,
    GraphReport,
    ShapePrior,
    Graph,
    Map,
    Landmarks,
    Table,
}

impl Content {
    /// Name of the kind, and what its files are known by.
    fn signs(self) -> (&'static str, Signs) {
        let (name, beginnings, fields): (_, &[&str], &[&str]) = match self {
            Self::Evaluation => ("an evaluation", &[], &["sequence", "camera", "first", "ego", "vehicles"]),
            Self::GraphReport => {
                ("a report of an optimisation", &[], &["file_cost", "final_cost", "termination"])
            }
            Self::ShapePrior => ("a shape prior", &[], &["format", "keypoints", "basis"]),
            Self::Graph => ("a g2o graph", &["VERTEX", "EDGE", "FIX", "PARAMS", "#"], &[]),
            Self::Map => ("a map", &["MCDRMAP\n"], &[]),
            Self::Landmarks => ("a PLY or GeoJSON file", &["ply\n"], &["type", "features"]),
            Self::Table => {
                ("a table of an ablation", &["| variant", "| sources", "variant,", "sources,"], &[])
            }
        };
        (name, Signs { beginnings, fields })
    }

    /// The objection to replacing a file.
    fn objection(self, path: &Path) -> Option<String> {
        let is_file = std::fs::metadata(path).is_ok_and(|found| found.is_file() && found.len() > 0);
        if !is_file {
            return None;
        }
        let (name, signs) = self.signs();
        (!signs.are_in(path)).then(|| {
            let path = path.display();
            format!("{path} is already there and is not {name}, which would replace it; choose another place, or delete it")
        })
    }
}

/// Marks of the files of a kind.
struct Signs {
    /// Beginnings after white space, one of them.
    beginnings: &'static [&'static str],
    /// Fields of a JSON object, all of them.
    fields: &'static [&'static str],
}

impl Signs {
    /// False too for a file that cannot be read.
    fn are_in(&self, path: &Path) -> bool {
        self.begin(path).unwrap_or(false) || (!self.fields.is_empty() && self.are_fields(path))
    }

    fn begin(&self, path: &Path) -> std::io::Result<bool> {
        let mut start = Vec::new();
        File::open(path)?.take(256).read_to_end(&mut start)?;
        let start = start.trim_ascii_start();
        Ok(self.beginnings.iter().any(|sign| start.starts_with(sign.as_bytes())))
    }

    fn are_fields(&self, path: &Path) -> bool {
        let Ok(file) = File::open(path) else { return false };
        serde_json::from_reader(BufReader::new(file)).is_ok_and(|object: Map<String, Value>| {
            self.fields.iter().all(|field| object.contains_key(*field))
        })
    }
}

/// An error where two of the files, each with the option that names it, are one. Later outputs would replace earlier ones, and inputs that are still
/// read.
pub fn all_different<'a>(
    files: impl IntoIterator<Item = (&'a str, &'a Path)>,
) -> Result<(), motorcade::Error> {
    let mut known: Vec<(&str, PathBuf)> = Vec::new();
    // Streams may take several, and folders have records of their own.
    let is_file = |path: &Path| std::fs::metadata(path).map_or(true, |found| found.is_file());
    for (option, path) in files.into_iter().filter(|(_, path)| is_file(path)) {
        let place = place(path);
        if let Some((other, _)) = known.iter().find(|(_, at)| *at == place) {
            let path = path.display();
            return Err(motorcade::Error::Config(format!(
                "{other} and {option} are both {path}; give each its own file"
            )));
        }
        known.push((option, place));
    }
    Ok(())
}

/// A path without links, also of what is not there yet.
fn place(path: &Path) -> PathBuf {
    let folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(folder).unwrap_or_else(|| path.to_path_buf())
}

/// A file to be written. Made before long work, so that a place that cannot be written is reported at once.
#[derive(Debug)]
pub struct OutFile {
    path: PathBuf,
    file: PendingFile,
}

impl OutFile {
    /// Checks the place.
    ///
    /// # Errors
    /// A file with other content, and those of [`PendingFile::create`].
    pub fn create(path: &Path, content: Content) -> Result<Self, motorcade::Error> {
        match content.objection(path) {
            Some(problem) => Err(motorcade::Error::Config(problem)),
            None => Self::replace(path),
        }
    }

    /// Checks the place of a file that replaces any other.
    pub fn replace(path: &Path) -> Result<Self, motorcade::Error> {
        let file = PendingFile::create(path).map_err(|e| io_error(path, &e))?;
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// The same for a file that may not be asked for.
    pub fn create_optional(path: Option<&Path>, content: Content) -> Result<Option<Self>, motorcade::Error> {
        path.map(|path| Self::create(path, content)).transpose()
    }

    /// Writes the content and puts the file in its place.
    pub fn write(self, text: impl AsRef<[u8]>) -> Result<(), motorcade::Error> {
        interruption::held_up(|| self.file.write(text)).map_err(|e| io_error(&self.path, &e))
    }
}

/// Directory of the drive of a demo: `runs/demo` → `runs/demo-drive`.
pub fn demo_drive(out: &Path) -> PathBuf {
    // `.` has no name of its own.
    let out =
        if out.file_name().is_none() { out.canonicalize().unwrap_or_default() } else { out.to_path_buf() };
    let mut name = out.file_name().unwrap_or("demo".as_ref()).to_owned();
    name.push("-drive");
    out.with_file_name(name)
}

/// A path in JSON; bytes that are no UTF-8 are replaced.
pub fn lossy<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
