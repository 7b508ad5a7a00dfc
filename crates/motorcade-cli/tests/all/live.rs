//! Live sources: standard input, addresses, devices. Skipped where ffmpeg is not installed.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "helpers of tests fail loudly, and say what they skip"
)]

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Answer, answer, drive, json, nothing_written, program, street};

const ONLINE: &str = "--online --calibration camera.toml --height 1.5 --out out --progress json";
/// Every third frame is 0.3 s late.
const UNEVEN: &str = "setpts=(N*0.1+floor(N/3)*0.2)/TB";

/// ffmpeg on the frames of a drive. `None` where it is not installed.
fn ffmpeg(folder: &Path, input: &[&str], output: &[&str]) -> Option<Child> {
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin"])
        .args(input)
        .args(["-framerate", "10", "-i", "frames/%06d.png"])
        .args(output)
        .current_dir(folder)
        .stdin(Stdio::null())
        .spawn();
    if made.is_err() {
        eprintln!("skipped: ffmpeg is not installed");
    }
    made.ok()
}

/// `drive.mkv` of the frames, whose times are uneven.
fn video(folder: &Path) -> bool {
    let codec = ["-vf", UNEVEN, "-fps_mode", "vfr", "-c:v", "ffv1", "drive.mkv"];
    ffmpeg(folder, &[], &codec).is_some_and(|mut child| child.wait().unwrap().success())
}

/// The program with a file on standard input.
fn from_stdin(folder: &Path, arguments: &str, input: impl Into<Stdio>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_motorcade"));
    command.args(arguments.split_whitespace()).current_dir(folder).env("MOTORCADE_MODELS", "none");
    command.stdin(input).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn kill(child: &Child, signal: &str) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn a_video_on_standard_input_is_estimated_as_the_file_is() {
    let folder = drive(14);
    let folder = folder.path();
    if !video(folder) {
        return;
    }
    let file = answer(folder, &format!("run drive.mkv {ONLINE}").replace("--out out", "--out file"));
    file.expect(0, &[]);
    let movie = || File::open(folder.join("drive.mkv")).unwrap();
    let output: Answer = from_stdin(folder, &format!("run - {ONLINE}"), movie()).output().unwrap().into();
    output.expect(0, &[]);
    assert_eq!(output.stdout, file.stdout, "presentation times are those of the file");
    for name in ["ego.tum", "frames.csv", "speeds.csv"] {
        let read = |run: &str| fs::read(folder.join(run).join(name)).unwrap();
        assert!(read("out") == read("file"), "{name}");
    }
    let record = json(&folder.join("out/run.json"));
    assert_eq!((&record["input"]["format"], &record["counters"]["frames"]), (&"live".into(), &14.into()));
    // Another run may see other frames: it is not taken for the same.
    from_stdin(folder, &format!("run - {ONLINE}"), movie())
        .output()
        .map(Answer::from)
        .unwrap()
        .expect(1, &["--force"]);
    let some = format!("run - {ONLINE} --force --frames 2..9 --stride 3");
    from_stdin(folder, &some, movie()).output().map(Answer::from).unwrap().expect(0, &[]);
    let tum = fs::read_to_string(folder.join("out/ego.tum")).unwrap();
    let times: Vec<f64> = tum.lines().map(|line| line.split(' ').next().unwrap().parse().unwrap()).collect();
    // Frames 2, 5 and 8 of an uneven rate, from the first one on.
    assert_eq!(times, [0.0, 0.5, 1.0]);
}

#[test]
fn a_stream_that_stays_open_ends_with_the_first_interrupt() {
    let folder = drive(12);
    let folder = folder.path();
    // A writer that stays: the first frames, then nothing more.
    let pipe = ["-c:v", "mjpeg", "-q:v", "2", "-f", "mpjpeg", "frames.mjpeg"];
    if !ffmpeg(folder, &[], &pipe).is_some_and(|mut child| child.wait().unwrap().success()) {
        return;
    }
    let mut feeder = Command::new("sh")
        .args(["-c", "cat frames.mjpeg; exec sleep 60"])
        .current_dir(folder)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    for threads in [1, 2] {
        let input = feeder.stdout.take().unwrap();
        let arguments = format!("run - {ONLINE} --force --threads {threads}");
        let mut child = from_stdin(folder, &arguments, input).spawn().unwrap();
        let (mut stderr, mut text) = (BufReader::new(child.stderr.take().unwrap()), String::new());
        while !text.contains("\"done\":5") {
            assert!(stderr.read_line(&mut text).unwrap() > 0, "{text}");
        }
        let start = Instant::now();
        kill(&child, "-INT");
        stderr.read_to_string(&mut text).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{text}");
        assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
        let frames = json(&folder.join("out/run.json"))["counters"]["frames"].as_u64().unwrap();
        assert!((5..=12).contains(&frames) && text.contains("interrupted"), "{frames}: {text}");
        kill(&feeder, "-KILL");
        feeder.wait().unwrap();
        feeder = Command::new("sh")
            .args(["-c", "cat frames.mjpeg; exec sleep 60"])
            .current_dir(folder)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
    }
    kill(&feeder, "-KILL");
    feeder.wait().unwrap();
}

#[test]
fn a_stream_of_the_network_is_read() {
    let folder = drive(10);
    let folder = folder.path();
    // A port that is free now.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let listen = format!("tcp://127.0.0.1:{port}?listen=1");
    let output = ["-c:v", "mpeg4", "-q:v", "2", "-f", "mpegts", &listen];
    let Some(mut server) = ffmpeg(folder, &["-re"], &output) else { return };
    let address = format!("run tcp://127.0.0.1:{port} {ONLINE}");
    // The server may not listen yet.
    let attempts = (0..50).map(|_| {
        std::thread::sleep(Duration::from_millis(200));
        answer(folder, &address)
    });
    let output = attempts.into_iter().find(|output| !output.stderr.contains("refused")).unwrap();
    server.wait().unwrap();
    output.expect(0, &[]);
    assert_eq!(output.stdout.lines().count(), 10);
    let times = fs::read_to_string(folder.join("out/ego.tum")).unwrap();
    let last: f64 = times.lines().last().unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((last - 0.9).abs() < 1e-3, "{last}");
}

#[test]
fn sources_that_are_none_are_named() {
    let folder = drive(2);
    let at = folder.path();
    let online = |input: &str| answer(at, &format!("run {input} {ONLINE}"));
    online("/dev/null").expect(3, &["/dev/null", "character device", "V4L2"]);
    online("/dev/video99").expect(3, &["/dev/video99"]);
    let file = File::open(at.join("camera.toml")).unwrap();
    let output: Answer = from_stdin(at, &format!("run - {ONLINE}"), file).output().unwrap().into();
    output.expect(if have_ffmpeg() { 3 } else { 5 }, &[]);
    if have_ffmpeg() {
        output.expect(3, &["-: gives no video"]);
        // Nobody listens on the discard port.
        online("rtsp://127.0.0.1:9/stream").expect(3, &["rtsp://127.0.0.1:9/stream", "Connection refused"]);
    }
    let without = format!("run - {ONLINE}").replace("--online ", "");
    answer(at, &without).expect(1, &["-", "live source", "--online"]);
    answer(at, "inspect rtsp://127.0.0.1:9/stream").expect(1, &["live source"]);
    nothing_written(at);
}

/// A program in the place of ffmpeg, which writes its arguments down and the frames of a drive as ffmpeg does.
fn stand_in(folder: &Path, frames: u64) {
    use std::os::unix::fs::PermissionsExt;
    let bin = folder.join("bin");
    fs::create_dir(&bin).unwrap();
    let mut said =
        "[Parsed_showinfo_0 @ 0x1] [info] config in time_base: 1/10, frame_rate: 10/1\n".to_owned();
    let mut pictures = Vec::new();
    for number in 0..frames {
        said += &format!("[Parsed_showinfo_0 @ 0x1] [info] n: {number} pts: {number} sar:1/1\n");
        let picture = image::DynamicImage::ImageLuma8(street(number as f64)).into_rgb8();
        pictures.extend(format!("P6\n{} {}\n255\n", picture.width(), picture.height()).into_bytes());
        pictures.extend(picture.into_raw());
    }
    fs::write(bin.join("said"), said).unwrap();
    fs::write(bin.join("pictures"), pictures).unwrap();
    let at = bin.display();
    let script = format!(
        "#!/bin/sh\n[ \"$1\" = -version ] && {{ echo ffmpeg version 7.0; exit; }}\n\
         echo \"$*\" >> {at}/arguments\ncat {at}/said >&2\nexec cat {at}/pictures\n"
    );
    fs::write(bin.join("ffmpeg"), script).unwrap();
    fs::set_permissions(bin.join("ffmpeg"), fs::Permissions::from_mode(0o755)).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn a_camera_is_read_by_its_interface() {
    let folder = drive(1);
    let at = folder.path();
    // Major number 81: Video4Linux.
    let made = Command::new("mknod")
        .args(["camera", "c", "81", "250"])
        .current_dir(at)
        .stderr(Stdio::null())
        .status();
    if !made.is_ok_and(|status| status.success()) {
        eprintln!("skipped: this system lets no test make a device (mknod needs root)");
        return;
    }
    stand_in(at, 12);
    let path = format!("{}:{}", at.join("bin").display(), std::env::var("PATH").unwrap());
    let mut command = program(at, &format!("run camera {ONLINE} --models none"));
    let output: Answer = command.env("PATH", path).output().unwrap().into();
    output.expect(0, &[]);
    let arguments = fs::read_to_string(at.join("bin/arguments")).unwrap();
    assert!(arguments.contains(" -f v4l2 -i camera "), "{arguments}");
    assert_eq!(arguments.lines().count(), 1, "{arguments}");
    let lines: Vec<serde_json::Value> =
        output.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((lines.len(), &lines[11]["frame"]), (12, &11.into()));
    let record = json(&at.join("out/run.json"));
    assert_eq!((&record["input"]["format"], &record["counters"]["frames"]), (&"live".into(), &12.into()));
    // Elsewhere a camera has no end.
    answer(at, "inspect camera").expect(1, &["camera", "live source"]);
}

#[test]
fn options_that_need_all_frames_are_refused() {
    let folder = drive(3);
    let folder = folder.path();
    if !video(folder) {
        return;
    }
    for option in ["--resume", "--overlay o.mp4", "--mcap o.mcap", "--trajectory ego.txt"] {
        let movie = File::open(folder.join("drive.mkv")).unwrap();
        let output: Answer =
            from_stdin(folder, &format!("run - {ONLINE} {option}"), movie).output().unwrap().into();
        output.expect(1, &[option.split(' ').next().unwrap(), "live source"]);
    }
    nothing_written(folder);
}

fn have_ffmpeg() -> bool {
    Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).status().is_ok()
}

/// `ffmpeg` with these arguments; false where it fails.
fn converted(folder: &Path, arguments: &str) -> bool {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "quiet", "-nostdin", "-y"]).args(arguments.split_whitespace()).current_dir(folder);
    command.stdin(Stdio::null()).status().is_ok_and(|status| status.success())
}

#[test]
fn inspect_prints_the_rotation_of_a_video_and_its_frames_are_turned() {
    let folder = drive(4);
    let at = folder.path();
    let Some(mut child) = ffmpeg(at, &[], &["-c:v", "libx264", "plain.mp4"]) else { return };
    assert!(child.wait().unwrap().success());
    let shown = |input: &str| -> serde_json::Value {
        serde_json::from_str(&answer(at, &format!("inspect {input} --json")).expect(0, &[]).stdout).unwrap()
    };
    let plain = shown("plain.mp4");
    assert!(plain["rotation_deg"].is_null(), "{plain}");
    // From ffmpeg 6 on by an option, before by the tag.
    assert!(
        converted(at, "-display_rotation 90 -i plain.mp4 -c copy turned.mp4")
            || converted(at, "-i plain.mp4 -c copy -metadata:s:v:0 rotate=270 turned.mp4")
    );
    let turned = shown("turned.mp4");
    assert_eq!(turned["rotation_deg"].as_i64().map(i64::abs), Some(90), "{turned}");
    assert_eq!((&turned["width"], &turned["height"]), (&plain["height"], &plain["width"]));
    let table = answer(at, "inspect turned.mp4").stdout;
    assert!(table.contains("degrees to the left by the container"), "{table}");
    let table = answer(at, "inspect plain.mp4").stdout;
    assert!(table.contains("\nrate         10.000 frames/s\n"), "{table}");
    assert!(video(at));
    let table = answer(at, "inspect drive.mkv").stdout;
    let rate = "10.000 frames/s in the middle, intervals from 0.100 to 0.300 s";
    assert!(table.contains(&format!("\nrate         {rate}\n")), "{table}");
}
