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
mod tests {
    use super::*;
    use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
    use crate::detectors::VehicleDetector;
    use crate::perception::Perception;

    /// Counts the frames it is asked for.
    struct Counter(Arc<Mutex<Vec<u64>>>);

    impl VehicleDetector for Counter {
        fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
            self.0.lock().unwrap().push(frame.number);
            let x = frame.number as f64 / 3.0;
            Ok(vec![Detection {
                class: VehicleClass::Car,
                score: 0.1 + 0.2,
                bbox: BoundingBox::new([x, 1.0, x + 20.0, 30.0]),
                convention: BoxConvention::VisibleExtent,
                external_id: None,
                pixel_size: 1.0,
                road_below: None,
            }])
        }
        fn description(&self) -> String {
            "a counter".into()
        }
    }

    fn frame(number: u64) -> Frame {
        let image = image::GrayImage::from_fn(40, 30, |x, y| image::Luma([(x * y + number as u32) as u8]));
        Frame { number, ..Frame::from_gray(image, number as i64) }
    }

    fn run(settings: &str) -> Identity {
        vec![("version".into(), "1".into()), ("settings".into(), settings.into())]
    }

    /// Observes frames; those that the detector saw, and all output.
    fn observe(
        checkpoint: Checkpoint,
        frames: std::ops::Range<u64>,
    ) -> Result<(Vec<u64>, Vec<Observations>)> {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let mut perception = Perception::none().with_detector(Counter(Arc::clone(&seen)));
        perception.save_in(checkpoint);
        let all = frames.map(|number| perception.observe(&frame(number))).collect::<Result<_>>()?;
        let seen = seen.lock().unwrap().clone();
        Ok((seen, all))
    }

    #[test]
    fn a_stopped_run_goes_on_wherever_its_file_ends() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint");
        assert!(Checkpoint::resume(&path, run("a")).unwrap().is_none());
        let (seen, expected) = observe(Checkpoint::create(&path, run("a")).unwrap(), 0..6).unwrap();
        assert_eq!(seen, [0, 1, 2, 3, 4, 5]);
        let whole = fs::read(&path).unwrap();
        for end in (0..=whole.len()).step_by(13).chain([whole.len()]) {
            fs::write(&path, &whole[..end]).unwrap();
            let lines = whole[..end].iter().filter(|b| **b == b'\n').count().saturating_sub(1);
            let checkpoint = Checkpoint::resume(&path, run("a")).unwrap().unwrap();
            let (seen, all) = observe(checkpoint.clone(), 0..6).unwrap();
            assert_eq!((seen.len(), checkpoint.replayed()), (6 - lines, lines), "{end}");
            assert!(all == expected && fs::read(&path).unwrap() == whole, "{end}");
        }
        // A line that is damaged, and all after it, are made again.
        let mut damaged = whole.clone();
        damaged[whole.len() / 2] = b'\x01';
        fs::write(&path, &damaged).unwrap();
        let checkpoint = Checkpoint::resume(&path, run("a")).unwrap().unwrap();
        assert_eq!(observe(checkpoint.clone(), 0..6).unwrap().1, expected);
        assert_eq!(fs::read(&path).unwrap(), whole);
        checkpoint.remove();
        assert!(!path.exists());
    }

    #[test]
    fn lines_are_forced_onto_the_disk_as_often_as_set() {
        let folder = tempfile::tempdir().unwrap();
        for (every, forced) in
            [(Duration::ZERO, true), (Duration::from_secs(3600), false), (Duration::MAX, false)]
        {
            let checkpoint = Checkpoint::create(&folder.path().join("checkpoint"), run("a")).unwrap();
            checkpoint.sync_every(every);
            let begun = checkpoint.state().synced;
            observe(checkpoint.clone(), 0..2).unwrap();
            assert_eq!(checkpoint.state().synced > begun, forced, "{every:?}");
        }
    }

    #[test]
    fn what_is_no_checkpoint_of_this_run_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint");
        let says = |made: Result<Option<Checkpoint>>, words: &str| {
            let error = made.unwrap_err().to_string();
            assert!(error.contains("checkpoint") && error.contains(words), "{error}");
        };
        let first = Checkpoint::create(&path, run("a")).unwrap();
        says(Checkpoint::create(&path, run("a")).map(Some), "another run is writing");
        observe(first, 0..2).unwrap();
        says(Checkpoint::resume(&path, run("b")), "another settings (a, now b)");
        let resumed = Checkpoint::resume(&path, run("a")).unwrap().unwrap();
        let error = observe(resumed, 1..3).unwrap_err().to_string();
        assert!(error.contains("frame 1 is not the picture"), "{error}");
        fs::write(&path, "frame,x1\n").unwrap();
        says(Checkpoint::resume(&path, run("a")), "line 1");
        #[cfg(unix)]
        {
            let link = folder.path().join("link-to-a-checkpoint");
            std::os::unix::fs::symlink(folder.path().join("mine"), &link).unwrap();
            says(Checkpoint::create(&link, run("a")).map(Some), "symbolic link");
            assert!(!folder.path().join("mine").exists());
        }
    }
}
