//! Videos whose container asks for their pictures to be turned. Skipped where ffmpeg is not installed.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "helpers of tests fail loudly, and say what they skip"
)]

use std::path::Path;
use std::process::{Command, Stdio};

use motorcade::dataset::{Sequence, SequenceOptions};
use motorcade::{Motorcade, NoProgress, push_sequence};

/// A second of video, as it is or with a container that asks for half a turn; false without ffmpeg.
fn ffmpeg(arguments: &str, folder: &Path) -> bool {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "quiet", "-nostdin", "-y"]).args(arguments.split_whitespace()).current_dir(folder);
    command.stdin(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// Warnings of a run over the video.
fn said(video: &Path) -> String {
    let calibration = video.with_file_name("camera.toml");
    std::fs::write(&calibration, "fx = 60.0\nfy = 60.0\ncx = 44.0\ncy = 29.5\nwidth = 96\nheight = 64\n")
        .unwrap();
    let options = SequenceOptions { calibration: Some(calibration), ..SequenceOptions::default() };
    let sequence = Sequence::open(video, &options).unwrap();
    let mut slam = Motorcade::builder(sequence.camera().unwrap()).height_m(1.5).build().unwrap();
    push_sequence(&mut slam, &sequence, 1, &NoProgress, &mut |_, _| ()).unwrap();
    slam.warnings().join("\n")
}

#[test]
fn a_run_doubts_the_calibration_of_pictures_turned_by_half() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    if !ffmpeg("-f lavfi -i testsrc=size=96x64:rate=10:duration=0.5 -c:v mpeg4 plain.mp4", at) {
        eprintln!("skipped: ffmpeg is not installed");
        return;
    }
    // From ffmpeg 6 on by an option, before by the tag.
    assert!(
        ffmpeg("-display_rotation 180 -i plain.mp4 -c copy turned.mp4", at)
            || ffmpeg("-i plain.mp4 -c copy -metadata:s:v:0 rotate=180 turned.mp4", at)
    );
    assert!(!said(&at.join("plain.mp4")).contains("turned"));
    let said = said(&at.join("turned.mp4"));
    assert!(said.contains("turned by 180 degrees") && said.contains("cx = 51.00, cy = 33.50"), "{said}");
}
