//! Files of a directory, as a record lists them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;

use motorcade_dataset::staging;
use serde::{Deserialize, Serialize};

/// Name of the checkpoint of a run in the directory of its results; it is no result.
pub const CHECKPOINT: &str = ".motorcade-checkpoint";

/// Name of the folder beside the checkpoint that holds the state of the run.
pub const CHECKPOINT_STATE: &str = ".motorcade-checkpoint.state";

/// Beginning of the names of the tables of vehicles that grow while online runs go on; they are no results.
pub const GROWING_TRACKS: &str = ".motorcade-tracks";

/// True of the names of a checkpoint, of the state beside it and of growing tables.
pub(super) fn is_checkpoint(name: &std::ffi::OsStr) -> bool {
    let grows = name.as_encoded_bytes().starts_with(GROWING_TRACKS.as_bytes());
    name == CHECKPOINT || name == CHECKPOINT_STATE || grows
}

/// A file of a directory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListedFile {
    /// Path relative to the directory, parts separated by `/`.
    pub name: String,
    /// Size \[bytes\].
    pub bytes: u64,
}

/// The files that a record lists under `files`. `None` when it lists none, or names outside its directory.
pub(super) fn listed(record: &[u8]) -> Option<Vec<ListedFile>> {
    let record: serde_json::Value = serde_json::from_slice(record).ok()?;
    let files: Vec<ListedFile> = serde_json::from_value(record.get("files")?.clone()).ok()?;
    let inside = |f: &ListedFile| f.name.split('/').all(|part| !["", ".", ".."].contains(&part));
    files.iter().all(inside).then_some(files)
}

/// All files below a directory in order of their names.
pub(super) fn files(directory: &Path) -> io::Result<Vec<ListedFile>> {
    let mut found = Vec::new();
    walk(directory, "", &mut |name, metadata| {
        if !metadata.is_dir() {
            found.push(ListedFile { name: name.to_owned(), bytes: metadata.len() });
        }
    })?;
    found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(found)
}

/// Everything in a directory that is neither one of the listed files, with its size, nor a folder of one, nor the record.
pub(super) fn foreign(directory: &Path, record: &str, listed: &[ListedFile]) -> io::Result<Vec<String>> {
    let sizes: BTreeMap<&str, u64> = listed.iter().map(|f| (f.name.as_str(), f.bytes)).collect();
    let mut found = Vec::new();
    walk(directory, "", &mut |name, metadata| {
        let own = if metadata.is_dir() {
            let start = format!("{name}/");
            sizes.range(start.as_str()..).next().is_some_and(|(file, _)| file.starts_with(&start))
        } else {
            metadata.is_file() && (name == record || sizes.get(name) == Some(&metadata.len()))
        };
        if !own && !is_lost_and_found(name, metadata) {
            found.push(name.to_owned());
        }
    })?;
    found.sort();
    Ok(found)
}

/// `lost+found`, which a file system has at its root.
fn is_lost_and_found(name: &str, metadata: &fs::Metadata) -> bool {
    name == "lost+found" && metadata.is_dir()
}

/// Visits everything below a directory but temporary directories and checkpoints of this program; links are not followed.
fn walk(directory: &Path, prefix: &str, visit: &mut dyn FnMut(&str, &fs::Metadata)) -> io::Result<()> {
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        let name = entry.file_name();
        if prefix.is_empty() && (is_checkpoint(&name) || staging::is_staging_name(&name)) {
            continue;
        }
        let name = format!("{prefix}{}", name.to_string_lossy());
        let metadata = entry.metadata()?;
        visit(&name, &metadata);
        if metadata.is_dir() && !is_lost_and_found(&name, &metadata) {
            walk(&entry.path(), &format!("{name}/"), visit)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_listed_files_of_the_listed_size_are_own() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.txt", "b/c.txt", "b/mine.txt", "empty/x", "d.txt"] {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, name).unwrap();
        }
        fs::remove_file(folder.path().join("empty/x")).unwrap();
        let listed = |name: &str, bytes| ListedFile { name: name.to_owned(), bytes };
        let list = [listed("a.txt", 5), listed("b/c.txt", 7), listed("d.txt", 4), listed("gone.txt", 1)];
        let found = foreign(folder.path(), "run.json", &list).unwrap();
        assert_eq!(found, ["b/mine.txt", "d.txt", "empty"]);
    }

    #[test]
    fn records_that_point_outside_list_nothing() {
        let with = |name: &str| serde_json::json!({"files": [{"name": name, "bytes": 1}]}).to_string();
        assert_eq!(listed(with("vehicles/1.tum").as_bytes()).unwrap().len(), 1);
        for name in ["../a", "/etc/passwd", "a/../../b", "a//b", ""] {
            assert_eq!(listed(with(name).as_bytes()), None, "{name}");
        }
        assert_eq!(listed(b"{}"), None);
    }
}
