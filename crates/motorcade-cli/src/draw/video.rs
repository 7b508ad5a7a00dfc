//! Video files through the `ffmpeg` program over a pipe.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

use motorcade::output::io_error;
use motorcade_dataset::Error;
use motorcade_dataset::atomic_file::PendingFile;

use crate::interruption::held_up;

const ADVICE: &str = "give a folder in place of a video, for PNG pictures";
/// Slowest and fastest video \[frames/s\].
const FPS: (f64, f64) = (0.1, 1000.0);

/// ffmpeg's name of the container for a file name; `None` for a name that is not a video's.
pub fn container(path: &Path) -> Option<&'static str> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "mp4" | "m4v" => Some("mp4"),
        "mov" => Some("mov"),
        "mkv" => Some("matroska"),
        "avi" => Some("avi"),
        _ => None,
    }
}

/// A video encoder of ffmpeg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoder {
    /// H.264.
    X264,
    /// MPEG-4 part 2, which every ffmpeg has.
    Mpeg4,
}

impl Encoder {
    /// The best one there is; `None` where ffmpeg is not installed.
    pub fn find() -> Result<Option<Self>, Error> {
        let output = Command::new("ffmpeg").args(["-hide_banner", "-encoders"]).stdin(Stdio::null()).output();
        match output {
            Ok(output) => {
                let x264 = String::from_utf8_lossy(&output.stdout).split_whitespace().any(|w| w == "libx264");
                Ok(Some(if x264 { Self::X264 } else { Self::Mpeg4 }))
            }
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(failed(format!("does not start: {e}"))),
        }
    }

    fn arguments(self) -> &'static [&'static str] {
        match self {
            // A fixed number of threads: the bytes depend on it. The preset takes two thirds of the time of `veryfast`, for a file a tenth
            // larger at this quality.
            Self::X264 => &["-c:v", "libx264", "-preset", "superfast", "-crf", "22", "-threads", "4"],
            Self::Mpeg4 => &["-c:v", "mpeg4", "-q:v", "3", "-threads", "1"],
        }
    }
}

fn failed(problem: String) -> Error {
    Error::Program { program: "ffmpeg".to_owned(), problem, advice: ADVICE }
}

/// A video being written under a temporary name.
pub struct VideoWriter {
    path: PathBuf,
    file: PendingFile,
    child: Running,
    pipe: Option<ChildStdin>,
    messages: Option<JoinHandle<String>>,
}

/// A process that ends with its owner.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Neither result matters: the process may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl VideoWriter {
    /// Starts ffmpeg for frames of this size \[px\].
    pub fn start(
        path: &Path,
        file: PendingFile,
        encoder: Encoder,
        (width, height): (u32, u32),
        fps: f64,
    ) -> anyhow::Result<Self> {
        let Some((staged, container)) = file.staged_path().zip(container(path)) else {
            let problem =
                io::Error::new(io::ErrorKind::InvalidInput, "is no regular file, which a video needs");
            return Err(io_error(path, &problem).into());
        };
        let mut url = std::ffi::OsString::from("file:");
        url.push(staged);
        let mut child = Command::new("ffmpeg")
            .args(["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args([
                "-s",
                &format!("{width}x{height}"),
                "-framerate",
                &format!("{:.5}", fps.clamp(FPS.0, FPS.1)),
            ])
            .args(["-i", "pipe:0", "-an"])
            .args(encoder.arguments())
            // Colours as high-definition players take them; no names of versions: the same frames give the same bytes.
            .args(["-vf", "scale=out_color_matrix=bt709:out_range=tv", "-pix_fmt", "yuv420p"])
            .args(["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"])
            .args(["-fflags", "+bitexact", "-movflags", "+faststart", "-f", container])
            .arg(url)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| failed(format!("does not start: {e}")))?;
        let pipe = child.stdin.take();
        // Read beside: a process whose messages nobody reads stops.
        let messages = child.stderr.take().map(|mut from| {
            std::thread::spawn(move || {
                let mut text = Vec::new();
                let _ = from.read_to_end(&mut text);
                String::from_utf8_lossy(&text).into_owned()
            })
        });
        Ok(Self { path: path.to_path_buf(), file, child: Running(child), pipe, messages })
    }

    /// Adds a frame, as RGB bytes.
    pub fn put(&mut self, rgb: &[u8]) -> Result<(), Error> {
        let written = held_up(|| self.pipe.as_mut().map_or(Ok(()), |pipe| pipe.write_all(rgb)));
        // It has ended, and says why.
        written
            .map_err(|e| self.ended().err().unwrap_or_else(|| failed(format!("takes no more frames: {e}"))))
    }

    /// Waits for the end of ffmpeg and puts the video in its place.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.ended()?;
        self.file.finish().map_err(|e| io_error(&self.path, &e))?;
        Ok(())
    }

    fn ended(&mut self) -> Result<(), Error> {
        drop(self.pipe.take());
        let status = held_up(|| self.child.0.wait()).map_err(|e| failed(format!("does not end: {e}")))?;
        let messages = self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        if status.success() {
            return Ok(());
        }
        let last = messages.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no reason given");
        Err(failed(format!("failed on {}: {last}", self.path.display())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn videos_are_known_by_their_names() {
        assert_eq!(container(Path::new("a/b.MP4")), Some("mp4"));
        assert_eq!(container(Path::new("b.mkv")), Some("matroska"));
        assert_eq!(container(Path::new("pictures")), None);
        assert_eq!(container(Path::new("v1.2")), None);
    }
}
