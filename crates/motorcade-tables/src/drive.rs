//! Runs by name.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::Result;

/// A run and its name in a dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drive {
    /// Identity: `drive_id` of all tables, and name of its files.
    pub id: String,
    /// Directory of the run.
    pub run: PathBuf,
}

impl Drive {
    /// A run by the name of its directory.
    pub fn new(run: &Path) -> Self {
        // `.` and `..` have no name of their own.
        let full = match run.file_name() {
            Some(_) => run.to_path_buf(),
            None => run.canonicalize().unwrap_or_default(),
        };
        let name = full.file_name().unwrap_or("run".as_ref());
        Self { id: name.to_string_lossy().into_owned(), run: run.to_path_buf() }
    }
}

/// Runs by the names of their directories.
///
/// # Errors
/// Two runs of one name, and none at all.
pub fn named(runs: &[PathBuf]) -> Result<Vec<Drive>> {
    if runs.is_empty() {
        return Err(motorcade::Error::Config("no runs; name at least one directory".into()).into());
    }
    let mut known = BTreeMap::<String, &Path>::new();
    for run in runs {
        let id = Drive::new(run).id;
        if let Some(before) = known.insert(id.clone(), run) {
            let (first, second) = (before.display(), run.display());
            let problem = format!(
                "{first} and {second} have the same name, {id}, which is their drive_id; rename one of the directories"
            );
            return Err(motorcade::Error::Config(problem).into());
        }
    }
    Ok(runs.iter().map(|run| Drive::new(run)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        let error = named(&["a/drive".into(), "b/drive".into()]).unwrap_err();
        assert!(error.to_string().contains("a/drive and b/drive") && error.exit_code() == 1, "{error}");
        assert_eq!(Drive::new(Path::new("runs/0005/")).id, "0005");
        assert!(!Drive::new(Path::new(".")).id.is_empty());
    }
}
