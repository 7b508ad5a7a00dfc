//! Video files through the `ffmpeg` and `ffprobe` programs over a pipe.

use std::io::{BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use image::RgbImage;

use super::layout::{Choice, Contents, Layout};
use super::slot::Store;
use crate::error::{Error, Result};
use crate::regular_file;

const INSTALL: &str =
    "install ffmpeg (it brings ffprobe), or extract the frames elsewhere and give their folder";

/// A video file.
pub(crate) struct Video;

impl Layout for Video {
    fn name(&self) -> &'static str {
        "video"
    }

    fn recognises(&self, _: &Path) -> Result<bool> {
        Ok(false)
    }

    fn contents(&self, root: &Path, _: Choice<'_>) -> Result<Contents> {
        let info = probe(root)?;
        let mut contents = Contents::stored(Store::Video(root.to_path_buf()));
        (contents.video_fps, contents.video_frames) = (Some(info.fps), info.frames);
        (contents.times_ns, contents.rotation_deg) = (info.times_ns, info.rotation_deg);
        Ok(contents)
    }
}

/// Output of `ffprobe`.
#[derive(Clone, Debug, PartialEq)]
struct VideoInfo {
    pub frames: u64,
    pub fps: f64,
    /// Presentation times from the first frame on \[ns\], a frame each; `None` where the file does not have them all.
    pub times_ns: Option<Vec<i64>>,
    /// Turn to the left by which the container asks to show the pictures \[°\]; ffmpeg applies it while it decodes.
    pub rotation_deg: Option<i32>,
}

pub(super) fn failed(program: &str, error: &std::io::Error) -> Error {
    let problem = match error.kind() {
        std::io::ErrorKind::NotFound => "is not installed".to_owned(),
        _ => format!("does not start: {error}"),
    };
    Error::Program { program: program.to_owned(), problem, advice: INSTALL }
}

/// Counts frames and reads the rate.
fn probe(path: &Path) -> Result<VideoInfo> {
    // Opening checks that it is a regular file: ffprobe would wait on a FIFO.
    regular_file::open(path).map_err(Error::io(path))?;
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-select_streams", "v:0", "-count_packets"])
        .args(["-show_entries", ENTRIES, "-of", "default=nw=1"])
        .arg("-i")
        .arg(file_url(path))
        .stdin(Stdio::null())
        .output()
        .map_err(|e| failed("ffprobe", &e))?;
    let messages = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(Error::input(path, format!("is not a readable video: {}", last_line(&messages))));
    }
    info(&String::from_utf8_lossy(&output.stdout)).map_err(|problem| Error::input(path, problem))
}

/// What is asked of `ffprobe`.
const ENTRIES: &str = "stream=avg_frame_rate,r_frame_rate,nb_read_packets,sample_aspect_ratio:stream_side_data=rotation:packet=pts_time,flags";

/// Reads the output of `ffprobe`: packets first, then the stream.
fn info(text: &str) -> std::result::Result<VideoInfo, String> {
    let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    let frames = value("nb_read_packets").and_then(|v| v.parse().ok()).unwrap_or(0);
    if frames == 0 {
        return Err("holds no video frames".to_owned());
    }
    if let Some(problem) = value("sample_aspect_ratio").and_then(not_square) {
        return Err(problem);
    }
    let rate = |key| value(key).and_then(ratio).filter(|fps: &f64| fps.is_finite() && *fps > 0.0);
    let fps = rate("avg_frame_rate")
        .or_else(|| rate("r_frame_rate"))
        .ok_or("has no frame rate; set one with the fps option")?;
    let rotation_deg = value("rotation").map(quarter_turn).transpose()?.filter(|turn| *turn != 0);
    Ok(VideoInfo { frames, fps, times_ns: presentation_times(text, frames), rotation_deg })
}

/// The turn by which a container asks to show its pictures \[°\]. One by no quarter would leave black corners in pictures of the same size.
pub(super) fn quarter_turn(stated: &str) -> std::result::Result<i32, String> {
    let turn_deg: Option<f64> = stated.parse().ok();
    // ffmpeg takes what is less than a degree off for a quarter turn.
    let quarter = turn_deg.map(|turn| (90.0 * (turn / 90.0).round(), turn));
    match quarter.filter(|(quarter, turn)| (quarter - turn).abs() < 1.0) {
        Some((quarter, _)) => Ok(quarter as i32 % 360),
        None => Err(format!(
            "asks for its pictures to be turned by {stated} degrees, which is no quarter turn; take that out \
             of the file, or turn the pictures themselves and calibrate those: ffmpeg -i INPUT OUTPUT"
        )),
    }
}

/// The objection to a sample aspect ratio, `None` for one that is or may be square.
pub(super) fn not_square(aspect: &str) -> Option<String> {
    (!["1:1", "0:1", "N/A"].contains(&aspect)).then(|| {
        format!(
            "has pixels that are not square (sample aspect ratio {aspect}); make them square, and calibrate that: \
             ffmpeg -i INPUT -vf scale=iw*sar:ih,setsar=1 OUTPUT"
        )
    })
}

/// Presentation times of all packets, from the first on. `None` when one is missing, is not shown or is shown twice.
fn presentation_times(text: &str, frames: u64) -> Option<Vec<i64>> {
    let discarded =
        text.lines().filter_map(|line| line.strip_prefix("flags=")).any(|flags| flags.contains('D'));
    let times = text.lines().filter_map(|line| line.strip_prefix("pts_time="));
    let mut times_s: Vec<f64> =
        times.map(|t| t.parse().ok().filter(|t: &f64| t.is_finite())).collect::<Option<_>>()?;
    // Packets come in the order of decoding.
    times_s.sort_by(f64::total_cmp);
    let first = *times_s.first()?;
    let times_ns: Vec<i64> = times_s.iter().map(|t| ((t - first) * 1e9).round() as i64).collect();
    let increasing = times_ns.windows(2).all(|pair| pair[0] < pair[1]);
    (!discarded && increasing && times_ns.len() as u64 == frames).then_some(times_ns)
}

/// The path as ffmpeg's file protocol: a file named `http:x.mp4` is a file.
pub(crate) fn file_url(path: &Path) -> std::ffi::OsString {
    let mut url = std::ffi::OsString::from("file:");
    url.push(path);
    url
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
    /// Begins at the first frame. The video ends before a picture that has not the size of the first one, where that is given: ffmpeg would stretch it.
    pub(crate) fn open(path: &Path, size: Option<(u32, u32)>) -> Result<Self> {
        let mut command = Command::new("ffmpeg");
        command.args(["-v", "error", "-nostdin", "-i"]).arg(file_url(path));
        if let Some((width, height)) = size {
            // Cropping to more than there is ends the conversion.
            let crop = format!("crop=w='if(eq(iw,{width})*eq(ih,{height}),iw,2*iw)':h=ih");
            command.args(["-vf", &crop]);
        }
        let mut child = command
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
                Error::input(path, format!(
                    "the video ends or breaks before frame {number}, or its pictures change their size there: {e}"
                ))
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
pub(super) fn passthrough() -> &'static str {
    let output = Command::new("ffmpeg").arg("-version").stdin(Stdio::null()).output();
    let text = output.map(|o| String::from_utf8_lossy(&o.stdout).into_owned()).unwrap_or_default();
    let version = text.strip_prefix("ffmpeg version ").unwrap_or("");
    let major: String = version.trim_start_matches('n').chars().take_while(char::is_ascii_digit).collect();
    if major.parse::<u32>().is_ok_and(|major| major < 6) { "-vsync" } else { "-fps_mode" }
}

/// Reads one binary 8-bit PPM image.
pub(super) fn read_ppm(pipe: &mut impl Read) -> std::io::Result<RgbImage> {
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
    fn times_are_those_of_the_packets_in_the_order_they_are_shown() {
        let probe = |times: &[&str], more: &str| {
            let packets: String = times.iter().map(|t| format!("pts_time={t}\nflags=K__\n")).collect();
            info(&format!("{packets}avg_frame_rate=10/1\nnb_read_packets={}\n{more}", times.len()))
        };
        let found = probe(&["1.00", "1.40", "1.10", "1.80"], "sample_aspect_ratio=1:1\n").unwrap();
        assert_eq!(found.times_ns, Some(vec![0, 100_000_000, 400_000_000, 800_000_000]));
        assert_eq!(probe(&["0", "N/A", "0.2"], "").unwrap().times_ns, None);
        assert_eq!(probe(&["0", "0", "0.2"], "").unwrap().times_ns, None);
        assert!(probe(&["0", "1"], "sample_aspect_ratio=4:3\n").unwrap_err().contains("4:3"));
        let turn = |stated: &str| probe(&["0", "1"], &format!("rotation={stated}\n")).map(|v| v.rotation_deg);
        assert_eq!([turn("0"), turn("-90"), turn("180.3")], [Ok(None), Ok(Some(-90)), Ok(Some(180))]);
        assert!(turn("45").unwrap_err().contains("turned by 45 degrees"));
        assert!(turn("nan").is_err());
    }

    #[test]
    fn ppm_pictures_follow_each_other() {
        let mut bytes: &[u8] = b"P6\n2 1\n255\nabcdefP6\n1 1\n255\nxyz";
        assert_eq!(read_ppm(&mut bytes).unwrap().as_raw(), b"abcdef");
        assert_eq!(read_ppm(&mut bytes).unwrap().as_raw(), b"xyz");
        assert!(read_ppm(&mut bytes).is_err());
    }
}
