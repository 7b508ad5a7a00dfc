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

/// Streams of two sizes in one file: ffmpeg would stretch the second to the first.
#[test]
fn pictures_that_change_their_size_are_not_stretched() {
    let folder = tempfile::tempdir().unwrap();
    let of = |size: &str| {
        let arguments = format!(
            "-v error -nostdin -f lavfi -i testsrc=size={size}:rate=10:duration=1 -c:v mpeg2video -f mpegts -"
        );
        let made = Command::new("ffmpeg").args(arguments.split(' ')).stdin(Stdio::null()).output();
        made.ok().filter(|made| made.status.success()).map(|made| made.stdout)
    };
    for (other, frames) in [("64x48", 20), ("32x48", 10), ("96x80", 10)] {
        let Some((first, second)) = of("64x48").zip(of(other)) else {
            eprintln!("skipped: ffmpeg is not installed");
            return;
        };
        let path = folder.path().join("two.ts");
        std::fs::write(&path, [first, second].concat()).unwrap();
        let sequence = Sequence::open(&path, &SequenceOptions::default()).unwrap();
        let (read, not): (Vec<_>, Vec<_>) = sequence.frames().partition(Result::is_ok);
        // A decoder may keep the last picture of the first stream.
        assert!((frames - 1..=frames).contains(&read.len()), "{other}: {}", read.len());
        assert!(not.iter().all(|e| e.as_ref().is_err_and(|e| e.to_string().contains("change their size"))));
        assert_eq!(read.len() + not.len(), sequence.len());
    }
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

/// The video again, with a container that asks for its pictures to be turned to the left by `turn_deg`. The same coded pictures.
fn turned(plain: &Path, turn_deg: i32) -> PathBuf {
    let path = plain.with_file_name(format!("turned{turn_deg}.mp4"));
    let made = |before: &[&str], after: &[&str]| {
        let mut command = Command::new("ffmpeg");
        command.args(["-v", "quiet", "-nostdin", "-y"]).args(before).arg("-i").arg(plain);
        command.args(["-c", "copy"]).args(after).arg(&path).stdin(Stdio::null());
        command.status().unwrap().success()
    };
    // From ffmpeg 6 on by an option, before by a tag.
    let (option, tag) = (turn_deg.to_string(), format!("rotate={turn_deg}"));
    assert!(made(&["-display_rotation", &option], &[]) || made(&[], &["-metadata:s:v:0", &tag]));
    path
}

#[test]
fn pictures_are_turned_as_the_container_asks() {
    use image::imageops::{rotate90, rotate180, rotate270};
    type Turn = fn(&image::RgbImage) -> image::RgbImage;
    let folder = tempfile::tempdir().unwrap();
    let Some(plain) = video(folder.path(), "plain.mp4", "null") else { return };
    let pictures = |path: &Path| -> Vec<image::RgbImage> {
        let sequence = Sequence::open(path, &SequenceOptions::default()).unwrap();
        sequence.frames().map(|frame| frame.unwrap().rgb().into_owned()).collect()
    };
    let upright = pictures(&plain);
    // Those of the library turn to the right.
    let turns: [(i32, Turn); 3] = [(90, rotate270), (180, rotate180), (270, rotate90)];
    for (turn_deg, expected) in turns {
        let path = turned(&plain, turn_deg);
        let told = Sequence::open(&path, &SequenceOptions::default()).unwrap().summary().rotation_deg;
        assert_eq!(told.map(|turn| turn.rem_euclid(360)), Some(turn_deg));
        let found = pictures(&path);
        assert_eq!(found.len(), 10);
        for (found, upright) in found.iter().zip(&upright) {
            let expected = expected(upright);
            assert_eq!(found.dimensions(), expected.dimensions());
            let differences = found.iter().zip(expected.iter()).map(|(a, b)| f64::from(a.abs_diff(*b)));
            let mean = differences.sum::<f64>() / found.len() as f64;
            // Colours have half the resolution, and may be interpolated before the turn or after it.
            assert!(mean < 1.0, "{turn_deg} degrees: {mean} grey values");
        }
    }
}

#[test]
fn a_calibration_of_turned_pictures_fits_or_is_doubted_or_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let Some(plain) = video(folder.path(), "plain.mp4", "null") else { return };
    let calibration = folder.path().join("camera.toml");
    std::fs::write(&calibration, "fx = 50.0\nfy = 50.0\ncx = 30.0\ncy = 27.0\nwidth = 64\nheight = 48\n")
        .unwrap();
    let options = SequenceOptions { calibration: Some(calibration), ..SequenceOptions::default() };
    let opened = |path: &Path| Sequence::open(path, &options);
    assert_eq!(opened(&plain).unwrap().turned_calibration(), None);
    let said = opened(&turned(&plain, 180)).unwrap().turned_calibration().unwrap();
    assert!(said.contains("180 degrees") && said.contains("cx = 33.00, cy = 20.00"), "{said}");
    let refused = opened(&turned(&plain, 90)).unwrap_err().to_string();
    assert!(refused.contains("64x48") && refused.contains("48x64"), "{refused}");
}
