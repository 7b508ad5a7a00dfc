//! Videos as phones and dash-cams write them. Skipped where ffmpeg is not installed.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "helpers of tests fail loudly, and say what they skip"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use motorcade_dataset::{FocalKind, Sequence, SequenceOptions};

/// A video of ten small pictures through this filter; `None` without ffmpeg.
fn video(folder: &Path, name: &str, filter: &str) -> Option<PathBuf> {
    let path = folder.join(name);
    let mut target = std::ffi::OsString::from("file:");
    target.push(&path);
    let made = Command::new("ffmpeg")
        .args([
            "-v",
            "error",
            "-nostdin",
            "-f",
            "lavfi",
            "-i",
            "testsrc=size=64x48:rate=10:duration=1",
            "-vf",
            filter,
        ])
        .args([
            "-fps_mode",
            "vfr",
            "-c:v",
            "mpeg4",
            "-q:v",
            "2",
            "-video_track_timescale",
            "1000",
            "-f",
            "mp4",
        ])
        .arg(target)
        .stdin(Stdio::null())
        .status();
    match made {
        Ok(status) => {
            assert!(status.success(), "ffmpeg made no {name}");
            Some(path)
        }
        Err(_) => {
            eprintln!("skipped: ffmpeg is not installed");
            None
        }
    }
}

fn times_ms(path: &Path, options: &SequenceOptions) -> Vec<i64> {
    let sequence = Sequence::open(path, options).unwrap();
    assert_eq!(sequence.frames().filter(Result::is_ok).count(), sequence.len(), "every time has its frame");
    sequence.timestamps_ns().map(|t| (t as f64 * 1e-6).round() as i64).collect()
}

#[test]
fn frames_have_the_times_at_which_they_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    // A tenth of a second, later two.
    let filter = "setpts='if(gt(N,4),N*2-4,N)/(10*TB)'";
    let Some(path) = video(folder.path(), "phone.mp4", filter) else { return };
    let times = times_ms(&path, &SequenceOptions::default());
    assert_eq!(times, [0, 100, 200, 300, 400, 600, 800, 1000, 1200, 1400]);
    // A rate that is given stands above them.
    let given = SequenceOptions { fps: Some(20.0), ..SequenceOptions::default() };
    assert_eq!(times_ms(&path, &given)[..3], [0, 50, 100]);
    let summary = Sequence::open(&path, &SequenceOptions::default()).unwrap().summary();
    assert!((summary.intervals_s.0 - 0.1).abs() < 1e-6 && (summary.intervals_s.1 - 0.2).abs() < 1e-6);
}

#[test]
fn pixels_that_are_not_square_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let Some(path) = video(folder.path(), "anamorphic.mp4", "setsar=4/3") else { return };
    let error = Sequence::open(&path, &SequenceOptions::default()).unwrap_err().to_string();
    assert!(error.contains("4:3") && error.contains("setsar=1"), "{error}");
}

#[test]
fn a_file_whose_name_looks_like_an_address_is_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let Some(path) = video(folder.path(), "http:x.mp4", "null") else { return };
    let name = Path::new("http:x.mp4");
    assert_eq!(times_ms(&path, &SequenceOptions::default()).len(), 10);
    assert_eq!(path.file_name().unwrap(), name);
}

#[test]
fn a_tag_of_the_video_gives_the_focal_length() {
    let folder = tempfile::tempdir().unwrap();
    let Some(plain) = video(folder.path(), "plain.mp4", "null") else { return };
    let focal = |path: &Path| Sequence::open(path, &SequenceOptions::default()).unwrap().focal_metadata();
    assert_eq!(focal(&plain), None);
    let tagged = folder.path().join("tagged.mp4");
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-i"])
        .arg(&plain)
        .args(["-c", "copy", "-movflags", "use_metadata_tags", "-metadata"])
        .arg("com.apple.quicktime.camera.focal_length.35mm_equivalent=26")
        .arg(&tagged)
        .status();
    assert!(made.unwrap().success());
    let found = focal(&tagged).unwrap();
    assert_eq!((found.kind, found.stated_mm), (FocalKind::ContainerFilm, 26.0));
    // 4:3 pictures by their diagonal and by their width, the mean of both.
    let (diagonal, width) = (26.0 / 43.2666 * 1.25, 26.0 / 36.0);
    assert!((found.widths - f64::sqrt(diagonal * width)).abs() < 1e-4, "{found:?}");
}
