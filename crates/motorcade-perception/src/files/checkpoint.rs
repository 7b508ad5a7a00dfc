//! Output of the detectors on disk while a run goes on: JSON lines, a frame as soon as it is observed. A run that was killed goes on
//! from there.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use motorcade_dataset::{Error as InputError, Fnv, Frame, Pixels, regular_file, staging};
use serde::{Deserialize, Serialize};

use super::recording::Line;
use crate::error::{Error, Result};
use crate::observations::Observations;

/// Version of the format.
const VERSION: u32 = 1;
/// Time after which lines are forced onto the disk, where none is set: what a failure of the whole machine can cost.
const SYNC_EVERY: Duration = Duration::from_secs(60);
/// Every how many bytes of a picture its hash takes one.
const HASHED: usize = 7;

/// The inputs that decide the output of a run, by name: the first part that differs is named in a refusal.
pub type Identity = Vec<(String, String)>;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    /// [`VERSION`]; its name says the format.
    motorcade_checkpoint: u32,
    run: Identity,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    /// Hash of the picture that was observed.
    pixels: String,
    observed: Line,
}

/// A frame of an earlier run that is not observed again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkippedFrame {
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// True of a frame that was observed for certain; one that did not read may have no output.
    pub observed: bool,
}

/// A file that holds the output of the detectors so far. Clones share it.
#[derive(Clone, Debug)]
pub struct Checkpoint(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    path: PathBuf,
    /// `None` once it cannot be written.
    file: Option<File>,
    /// Lines of an earlier run that are still to be given back.
    earlier: Option<BufReader<File>>,
    /// Bytes up to the last line taken.
    end: u64,
    synced: Instant,
    /// Time after which lines are forced onto the disk.
    sync_every: Duration,
    replayed: usize,
    problem: Option<String>,
}

impl Checkpoint {
    /// Starts a checkpoint in place of any that stands at `path`.
    ///
    /// # Errors
    /// A place that cannot be written, holds something else than a regular file, or another run's checkpoint that is in use.
    pub fn create(path: &Path, run: Identity) -> Result<Self> {
        let file = locked(path, OpenOptions::new().read(true).write(true).create(true).truncate(false))?;
        Self::start(path, file, run).map_err(at(path))
    }

    fn start(path: &Path, mut file: File, run: Identity) -> io::Result<Self> {
        file.set_len(0)?;
        file.rewind()?;
        let header = Header { motorcade_checkpoint: VERSION, run };
        let text = serde_json::to_string(&header)? + "\n";
        file.write_all(text.as_bytes())?;
        Ok(Self::new(path, file, None, text.len() as u64))
    }

    /// Goes on with the checkpoint at `path`; `None` where there is none.
    ///
    /// # Errors
    /// As [`create`](Self::create), and a checkpoint of another run: the part that differs is named.
    pub fn resume(path: &Path, run: Identity) -> Result<Option<Self>> {
        match fs::symlink_metadata(path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            found => found.map_err(at(path))?,
        };
        let file = locked(path, OpenOptions::new().read(true).write(true))?;
        let mut earlier = BufReader::new(file.try_clone().map_err(at(path))?);
        let mut text = String::new();
        earlier.read_line(&mut text).map_err(at(path))?;
        if !text.ends_with('\n') {
            // Killed before the first line was whole.
            return Self::start(path, file, run).map(Some).map_err(at(path));
        }
        let refused = |problem: String| Error::Input(InputError::Input { path: path.to_path_buf(), problem });
        let header: Header = serde_json::from_str(&text).map_err(|e| {
            refused(format!(
                "line 1 is not that of a checkpoint ({e}); remove the file, or run without --resume"
            ))
        })?;
        if header.motorcade_checkpoint != VERSION {
            return Err(refused(format!(
                "a checkpoint of version {}, expected {VERSION}; run without --resume to start over",
                header.motorcade_checkpoint
            )));
        }
        let part = |(name, value): &(String, String)| {
            !header.run.iter().any(|(other, its)| other == name && its == value)
        };
        if let Some((name, value)) = run.iter().find(|pair| part(pair)) {
            let before = header.run.iter().find(|(other, _)| other == name).map_or("nothing", |(_, its)| its);
            return Err(refused(format!(
                "the run that was stopped had another {name} ({before}, now {value}); repeat its command, or run without --resume to start over"
            )));
        }
        Ok(Some(Self::new(path, file, Some(earlier), text.len() as u64)))
    }

    fn new(path: &Path, file: File, earlier: Option<BufReader<File>>, end: u64) -> Self {
        let state = State {
            path: path.to_path_buf(),
            file: Some(file),
            earlier,
            end,
            synced: Instant::now(),
            sync_every: SYNC_EVERY,
            replayed: 0,
            problem: None,
        };
        Self(Arc::new(Mutex::new(state)))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Frames that were given back.
    pub fn replayed(&self) -> usize {
        self.state().replayed
    }

    /// Sets the time after which lines are forced onto the disk, a minute otherwise.
    pub fn sync_every(&self, time: Duration) {
        self.state().sync_every = time;
    }

    /// Why nothing more is written, once that is so. The run itself does not need the file.
    pub fn problem(&self) -> Option<String> {
        self.state().problem.clone()
    }

    /// Removes the file: the results are safe.
    pub fn remove(&self) {
        // Best effort: what stays does no harm.
        let _ = fs::remove_file(&self.state().path);
    }

    /// Forces all lines onto the disk.
    ///
    /// # Errors
    /// Those of the file system; a file that cannot be written any more.
    pub fn sync(&self) -> Result<()> {
        let mut state = self.state();
        state.synced = Instant::now();
        let synced = match &state.file {
            Some(file) => file.sync_data(),
            None => Err(io::Error::other("it could not be written")),
        };
        synced.map_err(at(&state.path))
    }

    /// Passes over the lines of the first frames of the earlier run, which `each` gets.
    pub(crate) fn skip(
        &self,
        frames: &[SkippedFrame],
        each: impl FnMut(&SkippedFrame, &Line) -> Result<()>,
    ) -> Result<()> {
        self.state().skip(frames, each)
    }

    /// The output for a frame of the earlier run, or `None` after its last one.
    pub(crate) fn earlier(&self, frame: &Frame) -> Result<Option<Observations>> {
        self.state().earlier(frame)
    }

    /// Writes the output for a frame.
    pub(crate) fn add(&self, frame: &Frame, observations: &Observations) {
        let mut state = self.state();
        if let Err(error) = state.add(frame, observations) {
            state.file = None;
            state.problem =
                Some(format!("{}: {error}; the run goes on without a checkpoint", state.path.display()));
        }
    }
}

impl State {
    fn earlier(&mut self, frame: &Frame) -> Result<Option<Observations>> {
        let Some(reader) = &mut self.earlier else { return Ok(None) };
        let mut text = String::new();
        let whole = reader.read_line(&mut text).is_ok() && text.ends_with('\n');
        let entry = serde_json::from_str::<Entry>(&text).ok().filter(|_| whole);
        let read = entry.and_then(|entry| {
            Some((entry.observed.frame(), entry.pixels, entry.observed.observations().ok()?))
        });
        let Some((number, pixels, observations)) = read else {
            // The end, or a line that was cut off: it is observed again.
            self.earlier = None;
            return Ok(None);
        };
        if number != frame.number || pixels != hash(&frame.pixels) {
            let problem = format!(
                "frame {} is not the picture that the stopped run had there; run without --resume to start over",
                frame.number
            );
            return Err(Error::Input(InputError::Input { path: self.path.clone(), problem }));
        }
        self.end += text.len() as u64;
        self.replayed += 1;
        Ok(Some(observations))
    }

    fn skip(
        &mut self,
        frames: &[SkippedFrame],
        each: impl FnMut(&SkippedFrame, &Line) -> Result<()>,
    ) -> Result<()> {
        let io = at(&self.path);
        let Some(reader) = &mut self.earlier else {
            let problem = "holds no frames of an earlier run".to_owned();
            return Err(Error::Input(InputError::Input { path: self.path.clone(), problem }));
        };
        // A look at all of them before anything changes.
        let checked = File::open(&self.path).and_then(|file| {
            let mut file = BufReader::new(file);
            file.seek(SeekFrom::Start(self.end))?;
            Ok(file)
        });
        let taken = skip_lines(&mut checked.map_err(io)?, frames, |_, _| Ok(()))?;
        let Some((lines, bytes)) = taken else {
            let problem = "does not hold all frames before the state that was kept of the run".to_owned();
            return Err(Error::Input(InputError::Input { path: self.path.clone(), problem }));
        };
        skip_lines(reader, frames, each)?;
        self.end += bytes;
        reader.seek(SeekFrom::Start(self.end)).map_err(at(&self.path))?;
        self.replayed += lines;
        Ok(())
    }

    fn add(&mut self, frame: &Frame, observations: &Observations) -> Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let entry = Entry { pixels: hash(&frame.pixels), observed: Line::of(frame.number, observations)? };
        let text = serde_json::to_string(&entry).map_err(|e| Error::Detector(Box::new(e)))? + "\n";
        let mut write = || {
            // A line that was cut off is removed.
            file.set_len(self.end)?;
            file.seek(SeekFrom::Start(self.end))?;
            file.write_all(text.as_bytes())?;
            if self.synced.elapsed() >= self.sync_every {
                file.sync_data()?;
                self.synced = Instant::now();
            }
            Ok(())
        };
        write().map_err(at(&self.path))?;
        self.end += text.len() as u64;
        Ok(())
    }
}

/// Gives the lines of frames to `each`; how many there are, and their bytes. `None` where one is missing.
fn skip_lines(
    reader: &mut impl BufRead,
    frames: &[SkippedFrame],
    mut each: impl FnMut(&SkippedFrame, &Line) -> Result<()>,
) -> Result<Option<(usize, u64)>> {
    let (mut left, mut lines, mut bytes, mut text) = (frames, 0, 0, String::new());
    while !left.is_empty() {
        text.clear();
        let whole = reader.read_line(&mut text).is_ok() && text.ends_with('\n');
        let entry = serde_json::from_str::<Entry>(&text).ok().filter(|_| whole);
        let Some(line) = entry.map(|entry| entry.observed) else { break };
        let Some(place) = left.iter().position(|frame| frame.number == line.frame()) else { break };
        if left[..place].iter().any(|frame| frame.observed) {
            break;
        }
        each(&left[place], &line)?;
        left = &left[place + 1..];
        (lines, bytes) = (lines + 1, bytes + text.len() as u64);
    }
    Ok((!left.iter().any(|frame| frame.observed)).then_some((lines, bytes)))
}

fn at(path: &Path) -> impl FnOnce(io::Error) -> Error + '_ {
    move |source| Error::Input(InputError::Io { path: path.to_path_buf(), source })
}

/// Opens a regular file, or makes one, and locks it.
fn locked(path: &Path, options: &OpenOptions) -> Result<File> {
    if fs::symlink_metadata(path).is_ok() {
        regular_file::not_a_link(path).map_err(at(path))?;
    }
    let file = options.open(path).map_err(at(path))?;
    if !staging::try_lock(&file) {
        let problem =
            "another run is writing this checkpoint; wait for it, or choose another --out".to_owned();
        return Err(Error::Input(InputError::Input { path: path.to_path_buf(), problem }));
    }
    Ok(file)
}

fn hash(pixels: &Pixels) -> String {
    let bytes: &[u8] = match pixels {
        Pixels::Gray(image) => image.as_raw(),
        Pixels::Rgb(image) => image.as_raw(),
    };
    let mut hash = Fnv::default();
    bytes.iter().step_by(HASHED).for_each(|byte| hash.add(&[*byte]));
    hash.to_string()
}

#[cfg(test)]
mod tests;
