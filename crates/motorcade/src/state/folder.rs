//! The folder that holds the state of a run: a file that is replaced as a whole, and the rows that were put away.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use motorcade_dataset::regular_file;

use super::file::{self, StateWriter};

const STATE: &str = "state";
const NEW: &str = "state.new";
/// All names in the folder.
const NAMES: [&str; 14] = [
    STATE,
    NEW,
    "motion",
    "road",
    "places",
    "detections",
    "keypoints",
    "poses",
    "vehicles",
    "settled_cameras",
    "settled_keyframes",
    "settled_matches",
    "settled_loops",
    "settled_by_map",
];

/// The folder of the state of one run.
#[derive(Clone, Debug)]
pub struct StateFolder {
    path: PathBuf,
    run: String,
}

impl StateFolder {
    /// The folder at a path, of the run with this fingerprint. Nothing is made before something is written.
    pub fn new(path: PathBuf, run: String) -> Self {
        Self { path, run }
    }

    /// Place of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// True where nothing is at the path, or a folder: a link is not followed.
    pub fn is_free(&self) -> bool {
        fs::symlink_metadata(&self.path).map_or(true, |found| found.is_dir())
    }

    /// Removes what an earlier run left there. Other files in the folder stay.
    pub fn clear(&self) {
        if fs::symlink_metadata(&self.path).is_ok_and(|found| found.is_dir()) {
            // Best effort: a state that stays is not used by a run that did not write it.
            NAMES.iter().for_each(|name| drop(fs::remove_file(self.path.join(name))));
            let _ = fs::remove_dir(&self.path);
        }
    }

    /// Replaces the state by what `fill` writes, part by part. The earlier one stays valid until the new one is on the disk. Returns the length of the file
    /// in bytes.
    ///
    /// # Errors
    /// Those of the file system and of `fill`.
    pub fn write<E: From<io::Error>>(
        &self,
        fill: impl FnOnce(&mut StateWriter) -> Result<(), E>,
    ) -> Result<u64, E> {
        fs::create_dir_all(&self.path)?;
        let (new, state) = (self.path.join(NEW), self.path.join(STATE));
        let write = || {
            // A link there is removed, not followed.
            let _ = fs::remove_file(&new);
            let file = fs::OpenOptions::new().write(true).create_new(true).open(&new)?;
            let mut writer = StateWriter::new(file, &self.run)?;
            let filled = fill(&mut writer);
            // That of the file system says more than that of who wrote to it.
            let length = writer.finish()?;
            filled?;
            fs::rename(&new, &state)?;
            Ok(length)
        };
        let written = write().inspect_err(|_: &E| drop(fs::remove_file(&new)))?;
        // The new name too; not every file system does that for a folder.
        let _ = File::open(&self.path).and_then(|folder| folder.sync_all());
        Ok(written)
    }

    /// The parts of the state that was written last; `None` where there is none.
    ///
    /// # Errors
    /// A file that is damaged, of another version or of another run.
    pub fn read(&self) -> io::Result<Option<Vec<Vec<u8>>>> {
        let bytes = match regular_file::read(&self.path.join(STATE)) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            read => read?,
        };
        file::parts(&bytes, &self.run).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::super::file::HEADER;
    use super::*;

    #[test]
    fn a_state_comes_back_or_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let state = |run: &str| StateFolder::new(folder.path().join("s"), run.to_owned());
        assert!(state("a").read().unwrap().is_none() && !state("a").path().exists());
        let parts = |n: u8| vec![vec![n; 300], Vec::new(), vec![7]];
        let write = |n: u8| {
            let fill = |to: &mut StateWriter| {
                for part in parts(n) {
                    to.write_all(&part[..part.len() / 2])?;
                    to.write_all(&part[part.len() / 2..])?;
                    to.end_part();
                }
                Ok::<(), io::Error>(())
            };
            state("a").write(fill).unwrap()
        };
        assert_eq!(write(1), write(2));
        assert_eq!(state("a").read().unwrap(), Some(parts(2)));
        let refused = |words: &str| {
            let error = state("a").read().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        assert!(state("b").read().unwrap_err().to_string().contains("another run"));
        let path = folder.path().join("s/state");
        let whole = fs::read(&path).unwrap();
        for end in [0, 10, HEADER, HEADER + 20, whole.len() - 1] {
            fs::write(&path, &whole[..end]).unwrap();
            refused(if end < HEADER { "none" } else { "damaged" });
        }
        for at in [HEADER, whole.len() - 1] {
            let mut damaged = whole.clone();
            damaged[at] ^= 1;
            fs::write(&path, &damaged).unwrap();
            refused("damaged");
        }
        let mut other = whole.clone();
        other[16] += 1;
        fs::write(&path, &other).unwrap();
        refused("another version");
        // What the file system left half written is not looked at, and what is not its own stays.
        fs::write(&path, &whole).unwrap();
        fs::write(folder.path().join("s/state.new"), "half").unwrap();
        fs::write(folder.path().join("s/mine"), "mine").unwrap();
        assert_eq!(state("a").read().unwrap(), Some(parts(2)));
        // One that could not be filled leaves the one before.
        let fails = |_: &mut StateWriter| Err(io::Error::other("no more"));
        assert_eq!(state("a").write(fails).unwrap_err().to_string(), "no more");
        assert_eq!(state("a").read().unwrap(), Some(parts(2)));
        state("a").clear();
        let left: Vec<_> =
            fs::read_dir(folder.path().join("s")).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left, ["mine"]);
    }
}
