//! Frames of a source that has no end known beforehand, through the `ffmpeg` program: standard input, a stream of the network, a camera.

use std::io::{BufRead, BufReader, IsTerminal};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use image::RgbImage;

use super::layout::{Choice, Contents, Layout};
use super::live_source::LiveSource;
use super::slot::Store;
use super::video::{failed, not_square, passthrough, quarter_turn, read_ppm};
use crate::error::{Error, Result};

/// Longest time between a picture and its time, which ffmpeg writes before it.
const TIME_WITHIN: Duration = Duration::from_secs(10);

/// Standard input, a stream of the network or a camera.
pub(crate) struct LiveInput;

impl Layout for LiveInput {
    fn name(&self) -> &'static str {
        "live"
    }

    fn recognises(&self, _: &Path) -> Result<bool> {
        Ok(false)
    }

    fn contents(&self, root: &Path, _: Choice<'_>) -> Result<Contents> {
        let source = LiveSource::recognise(root).ok_or_else(|| {
            Error::input(
                root,
                "is no live source; expected -, an address such as rtsp://HOST/PATH, or a V4L2 device",
            )
        })?;
        Ok(Contents::stored(Store::Live(source)))
    }
}

/// A picture and its presentation time \[ns\].
pub(crate) type Timed = (RgbImage, i64);

/// Pictures of a live source in order. Those whose time is not after the one before are left out.
#[derive(Debug)]
pub(crate) struct LiveReader {
    root: PathBuf,
    child: Child,
    pipe: BufReader<ChildStdout>,
    times: Receiver<std::result::Result<i64, String>>,
    errors: Arc<Mutex<String>>,
    last_ns: Option<i64>,
    read: u64,
    left_out: u64,
    /// True once ffmpeg has written its last picture.
    ended: bool,
}

impl LiveReader {
    pub(crate) fn open(root: &Path, source: &LiveSource) -> Result<Self> {
        let from_stdin = *source == LiveSource::Stdin;
        if from_stdin && std::io::stdin().is_terminal() {
            return Err(Error::Usage(
                "- reads a video from standard input, which is a terminal; write COMMAND | motorcade run -, or motorcade run - < FILE".into(),
            ));
        }
        let mut child = Command::new("ffmpeg")
            // Levels and single lines, so that errors and times are told apart.
            .args(["-hide_banner", "-nostats", "-nostdin", "-v", "repeat+level+info"])
            .args(source.arguments())
            .args(["-map", "0:v:0", "-vf", "showinfo", passthrough(), "passthrough"])
            .args(["-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "-"])
            .stdin(if from_stdin { Stdio::inherit() } else { Stdio::null() })
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| failed("ffmpeg", &e))?;
        let (Some(pipe), Some(log)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(Error::input(root, "ffmpeg gave no output"));
        };
        let (sender, times) = channel();
        let errors = Arc::new(Mutex::new(String::new()));
        let log_errors = Arc::clone(&errors);
        let spawned = std::thread::Builder::new()
            .name("motorcade-times".into())
            .spawn(move || read_log(log, &sender, &log_errors));
        spawned.map_err(Error::io(root))?;
        let pipe = BufReader::with_capacity(1 << 20, pipe);
        let root = root.to_path_buf();
        Ok(Self { root, child, pipe, times, errors, last_ns: None, read: 0, left_out: 0, ended: false })
    }

    /// The next picture; `None` at the end.
    ///
    /// # Errors
    /// A source that does not open, is no video, or has pixels that are not square.
    pub(crate) fn next(&mut self) -> Result<Option<Timed>> {
        loop {
            let Ok(image) = read_ppm(&mut self.pipe) else {
                self.ended = true;
                if self.read > 0 {
                    return Ok(None);
                }
                return Err(Error::input(&self.root, format!("gives no video: {}", self.reason())));
            };
            self.read += 1;
            let time = self.times.recv_timeout(TIME_WITHIN);
            let time = time.unwrap_or_else(|_| Err("ffmpeg gave no time of a frame".to_owned()));
            let time_ns = time.map_err(|problem| Error::input(&self.root, problem))?;
            if self.last_ns.is_none_or(|last| time_ns > last) {
                self.last_ns = Some(time_ns);
                return Ok(Some((image, time_ns)));
            }
            self.left_out += 1;
        }
    }

    /// Problems of the source, once it has ended.
    pub(crate) fn problems(&mut self) -> Vec<String> {
        let left_out = (self.left_out > 0).then(|| {
            let (left_out, read) = (self.left_out, self.read);
            format!(
                "{left_out} of {read} frames had a time that is not after the one before and were left out"
            )
        });
        let status = if self.ended { self.child.wait().ok() } else { None };
        let broken = status.filter(|status| !status.success());
        let broken = broken.map(|_| format!("{} broke off: {}", self.root.display(), self.reason()));
        left_out.into_iter().chain(broken).collect()
    }

    /// The first error that ffmpeg reported.
    fn reason(&self) -> String {
        let errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        if errors.is_empty() { "ffmpeg gave no reason".to_owned() } else { errors.clone() }
    }
}

impl Drop for LiveReader {
    fn drop(&mut self) {
        // Neither result matters: the process may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads what ffmpeg says: times of frames go to `times`, the first error is kept.
fn read_log(log: ChildStderr, times: &Sender<std::result::Result<i64, String>>, first_error: &Mutex<String>) {
    let mut clock = Clock::default();
    for line in BufReader::new(log).split(b'\n') {
        let Ok(line) = line else { return };
        let line = String::from_utf8_lossy(&line);
        if line.contains("[Parsed_showinfo") {
            if let Some(time) = clock.read(&line) {
                // The reader has gone: what is left is read, so that ffmpeg does not wait.
                let _ = times.send(time);
            }
        } else if let Some((_, stated)) = line.split_once("displaymatrix: rotation of ") {
            let stated = stated.split_whitespace().next().unwrap_or_default();
            if let Err(problem) = quarter_turn(stated) {
                let _ = times.send(Err(problem));
            }
        } else if let Some((_, error)) = line.split_once("[error] ").or_else(|| line.split_once("[fatal] ")) {
            let mut kept = first_error.lock().unwrap_or_else(PoisonError::into_inner);
            if kept.is_empty() {
                error.trim().clone_into(&mut kept);
            }
        }
    }
}

/// Times from the lines of ffmpeg's filter `showinfo`.
#[derive(Default)]
struct Clock {
    /// Seconds of a tick.
    tick_s: Option<(i128, i128)>,
    /// Size of the first picture.
    size: Option<String>,
}

impl Clock {
    /// The time of a frame \[ns\], or what is wrong with it; `None` for lines that are not of frames.
    fn read(&mut self, line: &str) -> Option<std::result::Result<i64, String>> {
        let value = |key: &str| {
            let (_, rest) = line.split_once(key)?;
            rest.split_whitespace().next().map(|word| word.trim_end_matches(','))
        };
        if let Some((a, b)) = value("config in time_base:").and_then(|text| text.split_once('/')) {
            self.tick_s = a.parse().ok().zip(b.parse().ok()).filter(|(_, b)| *b != 0);
            return None;
        }
        let ticks = value(" pts:")?;
        if let Some(problem) = value(" sar:").and_then(|aspect| not_square(&aspect.replace('/', ":"))) {
            return Some(Err(problem));
        }
        if let Some(size) = value(" s:") {
            let first = self.size.get_or_insert_with(|| size.to_owned());
            if first != size {
                return Some(Err(format!("changes the size of its pictures from {first} to {size} pixels")));
            }
        }
        let time = ticks.parse::<i128>().ok().zip(self.tick_s);
        let time_ns = time.and_then(|(ticks, (a, b))| i64::try_from(ticks * 1_000_000_000 * a / b).ok());
        Some(time_ns.ok_or_else(|| format!("a frame has no presentation time ({ticks})")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_told_from_files() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        std::fs::write(&file, "").unwrap();
        let of = |path: &str| LiveSource::recognise(Path::new(path));
        assert_eq!(of("-"), Some(LiveSource::Stdin));
        assert_eq!(of("rtsp://camera/1"), Some(LiveSource::Address("rtsp://camera/1".into())));
        assert_eq!(LiveSource::recognise(&file), None);
        // No file, no camera, no address that ffmpeg is given: its other protocols run commands or join files.
        for other in ["drive.mp4", "http:x.mp4", "concat://a", "file:///etc/passwd", "/dev/null", "/dev/zero"]
        {
            assert_eq!(of(other), None, "{other}");
        }
    }

    #[test]
    fn times_are_those_of_showinfo() {
        let mut clock = Clock::default();
        let mut read = |line: &str| clock.read(&format!("[Parsed_showinfo_0 @ 0x1] [info] {line}"));
        assert_eq!(read("config in time_base: 1/90000, frame_rate: 25/1"), None);
        let line = "n:   1 pts:  93600 pts_time:1.04    pos:     1 fmt:yuv420p sar:1/1 s:64x48 i:P";
        assert_eq!(read(line), Some(Ok(1_040_000_000)));
        assert_eq!(read("color_range:tv color_space:unknown"), None);
        assert!(read("n: 2 pts: NOPTS pts_time:NOPTS sar:0/1 s:64x48").unwrap().is_err());
        let wide = read("n: 3 pts: 97200 pts_time:1.08 sar:4/3 s:64x48").unwrap();
        assert!(wide.unwrap_err().contains("4:3"));
        let other = read("n: 4 pts: 100800 pts_time:1.12 sar:1/1 s:32x48").unwrap();
        assert_eq!(other.unwrap_err(), "changes the size of its pictures from 64x48 to 32x48 pixels");
    }
}
