//! The camera of a drive that nobody calibrated.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::io::Cursor;
use std::path::Path;

use crate::common::{answer, drive, json};
use tempfile::TempDir;

/// Focal length of a TOML calibration \[px\].
fn focal_px(text: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix("fx = ")).unwrap();
    line.parse().unwrap()
}

#[test]
fn a_drive_with_turns_determines_the_focal_length() {
    let folder = TempDir::new().unwrap();
    let render =
        "simulate --scenario figure-eight --frames 60 --width 414 --view-deg 62 --out drive --progress none";
    answer(folder.path(), render).expect(0, &[]);
    let calibrate = "calibrate drive/training --models none --out camera.toml";
    let said = answer(folder.path(), calibrate).stdout;
    for part in ["focal length", "principal point", "distortion k1", "mounting", "camera.toml"] {
        assert!(said.contains(part), "{said}");
    }
    let text = std::fs::read_to_string(folder.path().join("camera.toml")).unwrap();
    let truth = 0.5 * 414.0 / 31_f64.to_radians().tan();
    assert!((focal_px(&text) / truth).ln().abs() < 0.05, "{truth}: {text}");
    answer(folder.path(), "inspect drive/training --calibration camera.toml").expect(0, &[]);
    // A file that is there is not replaced unasked.
    answer(folder.path(), calibrate).expect(1, &["camera.toml is there already", "--force"]);

    let run = "run drive/training --calibration auto --models none --out out --progress none";
    answer(folder.path(), run).expect(0, &[]);
    let kept = std::fs::read_to_string(folder.path().join("out/camera.toml")).unwrap();
    assert_eq!(kept, text);
    let recorded = json(&folder.path().join("out/run.json"))["input"]["intrinsics_px"][0].as_f64().unwrap();
    assert!((recorded - focal_px(&kept)).abs() < 0.01, "{recorded}");
    assert!(answer(folder.path(), run).stdout.contains("already holds this run"));
    let draw = "draw out --frames 10..12 --out pictures --progress none";
    assert!(answer(folder.path(), draw).stdout.contains("2 frames drawn"));
}

#[test]
fn a_straight_drive_determines_no_focal_length() {
    let folder = drive(20);
    let calibrate = "calibrate frames --fps 10 --models none --out found.toml --progress none";
    answer(folder.path(), calibrate).expect(3, &["does not determine the focal length", "--view-deg"]);
    assert!(!folder.path().join("found.toml").exists());
    answer(folder.path(), &format!("{calibrate} --calibration camera.toml")).expect(1, &["--view-deg"]);
    answer(folder.path(), &format!("{calibrate} --view-deg 5")).expect(1, &["[10, 150] degrees"]);
    let onto_input = "calibrate found-ignore.png --out found.toml --force --models none";
    std::fs::copy(folder.path().join("frames/000000.png"), folder.path().join("found-ignore.png")).unwrap();
    answer(folder.path(), onto_input).expect(1, &["the input and the mask beside --out"]);
}

/// The frames of a folder as JPEG files whose EXIF states a focal length in 35 mm equivalents.
fn with_exif(frames: &Path, to: &Path, film_mm: u16) {
    // Little-endian TIFF: a directory with the place of the EXIF directory, which has one entry.
    let mut exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x69\x87\x04\0\x01\0\0\0\x1a\0\0\0\0\0\0\0".to_vec();
    exif.extend(b"\x01\0\x05\xa4\x03\0\x01\0\0\0");
    exif.extend(film_mm.to_le_bytes());
    exif.extend([0; 6]);
    std::fs::create_dir(to).unwrap();
    for entry in std::fs::read_dir(frames).unwrap() {
        let path = entry.unwrap().path();
        let mut jpeg = Cursor::new(Vec::new());
        image::open(&path).unwrap().write_to(&mut jpeg, image::ImageFormat::Jpeg).unwrap();
        let mut bytes = jpeg.into_inner();
        let mut segment = vec![0xff, 0xe1];
        segment.extend((exif.len() as u16 + 2).to_be_bytes());
        segment.extend(&exif);
        bytes.splice(2..2, segment);
        std::fs::write(to.join(path.file_name().unwrap()).with_extension("jpg"), bytes).unwrap();
    }
}

#[test]
fn exif_is_a_prior_of_the_focal_length() {
    let folder = drive(20);
    let path = |name: &str| folder.path().join(name);
    with_exif(&path("frames"), &path("pictures"), 30);
    // The drive is straight: what is known before decides, and says how well.
    let calibrate = "calibrate pictures --fps 10 --models none --progress none --set calibration.advanced.exif_film_sigma";
    let said =
        answer(folder.path(), &format!("{calibrate}=0.04 --out found.toml")).expect(0, &[]).stdout.clone();
    assert!(said.contains("by EXIF FocalLengthIn35mmFilm (30 mm)"), "{said}");
    let text = std::fs::read_to_string(path("found.toml")).unwrap();
    assert!(text.contains("# Known before the drive: 386 px ± 5 %"), "{text}");
    assert!((focal_px(&text) / 390.0).ln().abs() < 0.05, "{text}");
    // Trusted less it does not suffice, and a stated view replaces it.
    answer(folder.path(), &format!("{calibrate}=0.3 --out wide.toml"))
        .expect(3, &["does not determine the focal length"]);
    let stated = answer(folder.path(), &format!("{calibrate}=0.04 --view-deg 63,3 --out stated.toml"));
    assert!(stated.expect(0, &[]).stdout.contains("63 degrees across, as stated"), "{}", stated.stdout);
}
