//! Video files through the `ffmpeg` and `ffprobe` programs over a pipe.

use std::io::{BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use image::RgbImage;

use crate::error::{Error, Result};
use crate::regular_file;

const INSTALL: &str =
    "install ffmpeg (it brings ffprobe), or extract the frames elsewhere and give their folder";

/// Output of `ffprobe`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VideoInfo {
    pub frames: u64,
    pub fps: f64,
}

fn failed(program: &str, error: &std::io::Error) -> Error {
    let problem = match error.kind() {
        std::io::ErrorKind::NotFound => "is not installed".to_owned(),
        _ => format!("does not start: {error}"),
    };
    Error::Program { program: program.to_owned(), problem, advice: INSTALL }
}

/// Counts frames and reads the rate.
pub(crate) fn probe(path: &Path) -> Result<VideoInfo> {
    // Opening checks that it is a regular file: ffprobe would wait on a FIFO.
    regular_file::open(path).map_err(Error::io(path))?;
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-select_streams", "v:0", "-count_packets"])
        .args(["-show_entries", "stream=avg_frame_rate,r_frame_rate,nb_read_packets", "-of", "default=nw=1"])
        .arg(path)
        .stdin(Stdio::null())
        .output()
        .map_err(|e| failed("ffprobe", &e))?;
    let messages = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(Error::input(path, format!("is not a readable video: {}", last_line(&messages))));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    let frames = value("nb_read_packets").and_then(|v| v.parse().ok()).unwrap_or(0);
    if frames == 0 {
        return Err(Error::input(path, "holds no video frames"));
    }
    let rate = |key| value(key).and_then(ratio).filter(|fps| fps.is_finite() && *fps > 0.0);
    let fps = rate("avg_frame_rate")
        .or_else(|| rate("r_frame_rate"))
        .ok_or_else(|| Error::input(path, "has no frame rate; set one with the fps option"))?;
    Ok(VideoInfo { frames, fps })
}

fn ratio(text: &str) -> Option<f64> {
    let (a, b) = text.split_once('/')?;
    Some(a.parse::<f64>().ok()? / b.parse::<f64>().ok()?)
}

fn last_line(text: &str) -> &str {
    text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no reason given")
}

/// Frames of a video in order.
pub(crate) struct VideoReader {
    child: Child,
    pipe: BufReader<ChildStdout>,
    next: u64,
}

impl VideoReader {
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let mut child = Command::new("ffmpeg")
            .args(["-v", "error", "-nostdin", "-i"])
            .arg(path)
            // One output frame per coded frame: none is duplicated or dropped to keep a rate.
            .args(["-map", "0:v:0", passthrough(), "passthrough"])
            .args(["-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "-"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|e| failed("ffmpeg", &e))?;
        let Some(pipe) = child.stdout.take() else {
            return Err(Error::input(path, "ffmpeg gave no output"));
        };
        Ok(Self { child, pipe: BufReader::with_capacity(1 << 20, pipe), next: 0 })
    }

    /// The frame with this number; earlier ones are skipped. Numbers must increase from call to call.
    pub(crate) fn frame(&mut self, path: &Path, number: u64) -> Result<RgbImage> {
        loop {
            let image = read_ppm(&mut self.pipe).map_err(|e| {
                Error::input(path, format!("the video ends or breaks before frame {number}: {e}"))
            })?;
            self.next += 1;
            if self.next > number {
                return Ok(image);
            }
        }
    }
}

impl Drop for VideoReader {
    fn drop(&mut self) {
        // Neither result matters: the process may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// `-vsync` was renamed in ffmpeg 5.1 and is going away.
fn passthrough() -> &'static str {
    let output = Command::new("ffmpeg").arg("-version").stdin(Stdio::null()).output();
    let text = output.map(|o| String::from_utf8_lossy(&o.stdout).into_owned()).unwrap_or_default();
    let version = text.strip_prefix("ffmpeg version ").unwrap_or("");
    let major: String = version.trim_start_matches('n').chars().take_while(char::is_ascii_digit).collect();
    if major.parse::<u32>().is_ok_and(|major| major < 6) { "-vsync" } else { "-fps_mode" }
}

/// Reads one binary 8-bit PPM image.
fn read_ppm(pipe: &mut impl Read) -> std::io::Result<RgbImage> {
    let invalid = |text: &str| std::io::Error::new(std::io::ErrorKind::InvalidData, text.to_owned());
    if token(pipe)? != "P6" {
        return Err(invalid("not a PPM picture"));
    }
    let mut number = || token(pipe)?.parse::<u32>().map_err(|_| invalid("no number in the PPM header"));
    let (width, height, max) = (number()?, number()?, number()?);
    if max != 255 || width == 0 || height == 0 || u64::from(width) * u64::from(height) > 1 << 28 {
        return Err(invalid("a PPM header with an impossible size"));
    }
    let mut bytes = vec![0; 3 * width as usize * height as usize];
    pipe.read_exact(&mut bytes)?;
    RgbImage::from_raw(width, height, bytes).ok_or_else(|| invalid("a picture of the wrong length"))
}

/// A word of the header and the white space after it.
fn token(pipe: &mut impl Read) -> std::io::Result<String> {
    let mut word = String::new();
    let mut byte = [0];
    while word.len() < 16 {
        pipe.read_exact(&mut byte)?;
        if byte[0].is_ascii_whitespace() {
            return Ok(word);
        }
        word.push(char::from(byte[0]));
    }
    Ok(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ppm_pictures_follow_each_other() {
        let mut bytes: &[u8] = b"P6\n2 1\n255\nabcdefP6\n1 1\n255\nxyz";
        assert_eq!(read_ppm(&mut bytes).unwrap().as_raw(), b"abcdef");
        assert_eq!(read_ppm(&mut bytes).unwrap().as_raw(), b"xyz");
        assert!(read_ppm(&mut bytes).is_err());
    }
}
