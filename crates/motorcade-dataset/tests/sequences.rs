//! Every kind of input, and every way in which it can be broken.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::path::Path;
use std::process::Command;

use image::{GrayImage, Luma, Rgb, RgbImage};
use motorcade_dataset::{Format, Sequence, SequenceOptions};

const TOML: &str = "fx = 50.0\nfy = 50.0\ncx = 31.5\ncy = 23.5\nwidth = 64\nheight = 48\n";

fn gray(value: u8) -> GrayImage {
    GrayImage::from_pixel(64, 48, Luma([value]))
}

fn folder(numbers: &[u64]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for number in numbers {
        gray(*number as u8).save(folder.path().join(format!("{number:06}.png"))).unwrap();
    }
    std::fs::write(folder.path().join("calibration.toml"), TOML).unwrap();
    folder
}

fn open(path: &Path) -> Sequence {
    Sequence::open(path, &SequenceOptions::default()).unwrap()
}

fn refusal(path: &Path, options: &SequenceOptions) -> (String, u8) {
    let error = Sequence::open(path, options).unwrap_err();
    (error.to_string(), error.exit_code())
}

#[test]
fn frames_come_in_order_with_times_ranges_and_strides() {
    let folder = folder(&[3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    for prefetch in [0, 1, 4] {
        let options = SequenceOptions {
            frames: "5..=11".parse().unwrap(),
            stride: 3,
            fps: Some(20.0),
            prefetch,
            ..SequenceOptions::default()
        };
        let drive = Sequence::open(folder.path(), &options).unwrap();
        assert_eq!((drive.len(), drive.format()), (3, Format::Images));
        let frames: Vec<_> = drive.frames().map(Result::unwrap).collect();
        let seen: Vec<_> = frames
            .iter()
            .map(|f| (f.index, f.number, f.timestamp_ns, f.gray().get_pixel(9, 9).0[0]))
            .collect();
        assert_eq!(seen, [(0, 5, 100_000_000, 5), (1, 8, 250_000_000, 8), (2, 11, 400_000_000, 11)]);
    }
}

#[test]
fn broken_frames_keep_their_rows() {
    let folder = folder(&[0, 1, 2, 4, 5, 6]);
    let file = |n: u64| folder.path().join(format!("{n:06}.png"));
    let bytes = std::fs::read(file(1)).unwrap();
    std::fs::write(file(1), &bytes[..bytes.len() / 2]).unwrap();
    GrayImage::new(32, 32).save(file(2)).unwrap();
    std::fs::write(file(5), b"").unwrap();
    let items: Vec<_> = open(folder.path()).frames().collect();
    let later: Vec<_> = open(folder.path()).frames_from(1).collect();
    let rows = |items: &[motorcade_dataset::FrameResult]| -> Vec<(usize, u64, bool)> {
        let row = |item: &motorcade_dataset::FrameResult| match item {
            Ok(frame) => (frame.index, frame.number, true),
            Err(bad) => (bad.index, bad.number, false),
        };
        items.iter().map(row).collect()
    };
    assert_eq!(rows(&later), rows(&items[1..]));
    assert_eq!(open(folder.path()).frames_from(items.len()).count(), 0);
    assert_eq!(items.len(), 7);
    let reasons: Vec<String> =
        items.iter().filter_map(|item| item.as_ref().err()).map(ToString::to_string).collect();
    for (reason, parts) in reasons.iter().zip([
        ["frame 1", "truncated"],
        ["frame 2", "32x32 but the first frame is 64x48"],
        ["frame 3", "missing"],
        ["frame 5", "is empty"],
    ]) {
        assert!(parts.iter().all(|part| reason.contains(part)), "{reason}");
    }
    assert_eq!(reasons.len(), 4);
    assert!(items.iter().enumerate().all(|(i, item)| match item {
        Ok(frame) => frame.index == i && frame.timestamp_ns == 100_000_000 * i as i64,
        Err(bad) => bad.index == i && bad.number == i as u64,
    }));
}

#[test]
fn a_truncated_jpeg_is_an_error_not_grey_pixels() {
    let folder = folder(&[]);
    let picture = GrayImage::from_fn(64, 48, |x, y| Luma([(x * 3 + y * y) as u8]));
    for n in 0..2 {
        picture.save(folder.path().join(format!("{n}.JPG"))).unwrap();
    }
    let path = folder.path().join("1.JPG");
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let items: Vec<_> = open(folder.path()).frames().collect();
    assert!(items[0].is_ok());
    assert!(items[1].as_ref().unwrap_err().to_string().contains("truncated"));
}

#[test]
fn unusable_inputs_are_errors() {
    let empty = tempfile::tempdir().unwrap();
    let options = SequenceOptions::default();
    let (message, code) = refusal(empty.path(), &options);
    assert!(message.contains("holds no frames") && code == 3, "{message}");
    let (message, code) = refusal(&empty.path().join("nowhere"), &options);
    assert!(message.contains("nowhere") && code == 3, "{message}");

    let folder = folder(&[1, 2]);
    let outside = SequenceOptions { frames: "7..9".parse().unwrap(), ..SequenceOptions::default() };
    let (message, code) = refusal(folder.path(), &outside);
    assert!(message.contains("from 1 to 2") && code == 1, "{message}");
    std::fs::write(folder.path().join("calibration.toml"), TOML.replace("64", "1242").replace("48", "375"))
        .unwrap();
    let (message, code) = refusal(folder.path(), &options);
    assert!(message.contains("1242x375") && message.contains("64x48") && code == 3, "{message}");
    std::fs::remove_file(folder.path().join("calibration.toml")).unwrap();
    let drive = open(folder.path());
    assert_eq!(drive.camera().unwrap_err().exit_code(), 1);
    std::fs::write(folder.path().join("000001.png"), b"not a picture").unwrap();
    let (message, code) = refusal(folder.path(), &options);
    assert!(message.contains("000001.png") && code == 3, "{message}");
}

#[test]
fn height_is_asked_for_and_checked() {
    let folder = folder(&[1]);
    let drive = open(folder.path());
    assert!(drive.height_m(None).unwrap_err().to_string().contains("--height"));
    for height in [0.0, -1.0, f64::NAN] {
        assert_eq!(drive.height_m(Some(height)).unwrap_err().exit_code(), 1);
    }
    assert_eq!(drive.height_m(Some(1.2)).unwrap(), 1.2);
}

#[test]
fn masks_for_all_and_by_number() {
    let folder = folder(&[1, 2, 3]);
    let masks = tempfile::tempdir().unwrap();
    let with = |path: &Path| {
        let options = SequenceOptions { ignore: Some(path.to_path_buf()), ..SequenceOptions::default() };
        let drive = Sequence::open(folder.path(), &options).unwrap();
        drive.frames().map(|f| f.unwrap().ignore.map(|m| m.get_pixel(0, 0).0[0])).collect::<Vec<_>>()
    };
    gray(255).save(masks.path().join("bonnet.png")).unwrap();
    assert_eq!(with(masks.path()), [Some(255); 3]);
    assert_eq!(with(&masks.path().join("bonnet.png")), [Some(255); 3]);
    std::fs::remove_file(masks.path().join("bonnet.png")).unwrap();
    gray(9).save(masks.path().join("000001.png")).unwrap();
    gray(8).save(masks.path().join("000003.png")).unwrap();
    assert_eq!(with(masks.path()), [Some(9), None, Some(8)]);
    GrayImage::new(10, 10).save(masks.path().join("000001.png")).unwrap();
    let options = SequenceOptions { ignore: Some(masks.path().to_path_buf()), ..SequenceOptions::default() };
    assert!(refusal(folder.path(), &options).0.contains("10x10"));
}

#[test]
fn kitti_tracking_and_odometry() {
    let root = tempfile::tempdir().unwrap();
    let p = "700 0 31 0 0 700 23 0 0 0 1 0";
    for (camera, sequence) in [(2, "0003"), (2, "0005"), (3, "0005")] {
        let images = root.path().join(format!("image_{camera:02}/{sequence}"));
        std::fs::create_dir_all(&images).unwrap();
        for n in 16..19 {
            RgbImage::from_pixel(64, 48, Rgb([255, 0, 0])).save(images.join(format!("{n:06}.png"))).unwrap();
        }
    }
    std::fs::create_dir_all(root.path().join("calib")).unwrap();
    std::fs::write(
        root.path().join("calib/0005.txt"),
        format!("P2: {p}\nP3: {}\n", p.replacen("31 0", "31 -350", 1)),
    )
    .unwrap();
    let mut options = SequenceOptions::default();
    let (message, code) = refusal(root.path(), &options);
    assert!(message.contains("0003, 0005") && code == 1, "{message}");
    options.sequence = Some("0005".into());
    options.camera = Some(3);
    let drive = Sequence::open(root.path(), &options).unwrap();
    assert_eq!((drive.format(), drive.height_m(None).unwrap()), (Format::KittiTracking, 1.65));
    assert_eq!(drive.camera_from_cam0().translation().x, -0.5);
    let first = drive.frames().next().unwrap().unwrap();
    assert_eq!(
        (first.number, first.timestamp_ns, first.gray().get_pixel(0, 0).0[0]),
        (16, 1_600_000_000, 76)
    );
    options.sequence = Some("0099".into());
    assert!(refusal(root.path(), &options).0.contains("no sequence `0099`"));

    let root = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(root.path().join("image_0")).unwrap();
    for n in 0..3 {
        gray(n).save(root.path().join(format!("image_0/{n:06}.png"))).unwrap();
    }
    std::fs::write(root.path().join("calib.txt"), format!("P0: {p}\n")).unwrap();
    std::fs::write(root.path().join("times.txt"), "0.0\n1.04e-01\n2.07e-01\n").unwrap();
    let drive = open(root.path());
    assert_eq!(drive.format(), Format::KittiOdometry);
    assert_eq!(drive.timestamps_ns().collect::<Vec<_>>(), [0, 104_000_000, 207_000_000]);
    assert_eq!(drive.camera().unwrap().fx, 700.0);
}

#[test]
fn the_fingerprint_follows_the_input() {
    let folder = folder(&[1, 2, 3]);
    let before = open(folder.path()).summary();
    assert_eq!(before, open(folder.path()).summary());
    std::fs::write(folder.path().join("calibration.toml"), TOML.replace("fx = 50.0", "fx = 50.1")).unwrap();
    assert_ne!(before.input_hash, open(folder.path()).summary().input_hash);
}

#[test]
fn video_through_ffmpeg() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.mp4");
    let made = Command::new("ffmpeg")
        .args([
            "-v",
            "error",
            "-f",
            "lavfi",
            "-i",
            "testsrc=size=64x48:rate=25:duration=1",
            "-pix_fmt",
            "yuv420p",
        ])
        .arg(&path)
        .status();
    if !made.is_ok_and(|status| status.success()) {
        std::fs::write(&path, "no program will look at this").unwrap();
        let (message, code) = refusal(&path, &SequenceOptions::default());
        assert!(message.contains("`ffprobe` is not installed") && code == 5, "{message}");
        println!("skipped: ffmpeg is not installed");
        return;
    }
    let options =
        SequenceOptions { stride: 5, frames: "10..21".parse().unwrap(), ..SequenceOptions::default() };
    let drive = Sequence::open(&path, &options).unwrap();
    assert_eq!((drive.format(), drive.size()), (Format::Video, (64, 48)));
    let frames: Vec<_> = drive.frames().map(Result::unwrap).collect();
    let times: Vec<_> = frames.iter().map(|f| (f.number, f.timestamp_ns)).collect();
    assert_eq!(times, [(10, 400_000_000), (15, 600_000_000), (20, 800_000_000)]);
    // The test pattern moves, so passing over frames must show different pictures.
    assert_ne!(frames[0].rgb().as_raw(), frames[1].rgb().as_raw());
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let (message, code) = refusal(&path, &SequenceOptions::default());
    assert!(message.contains("not a readable video") && code == 3, "{message}");
}

#[test]
fn kitti_raw_drives_bring_their_clock() {
    let day = tempfile::tempdir().unwrap();
    let drive = day.path().join("drive_0001_sync");
    std::fs::create_dir_all(drive.join("image_02/data")).unwrap();
    for n in 0..3 {
        gray(n).save(drive.join(format!("image_02/data/{n:010}.png"))).unwrap();
    }
    let clock =
        "2011-09-26 23:59:59.900000000\n2011-09-27 00:00:00.003500000\n2011-09-27 00:00:00.100000000\n";
    std::fs::write(drive.join("image_02/timestamps.txt"), clock).unwrap();
    let calibration = "calib_time: 09-Jan-2012 13:57:47\nK_02: 1 0 0 0 1 0 0 0 1\nS_rect_02: 6.4e+01 4.8e+01\n\
                       P_rect_02: 700 0 31 44.9 0 700 23 0.2 0 0 1 0.003\n";
    std::fs::write(day.path().join("calib_cam_to_cam.txt"), calibration).unwrap();
    let drive = open(&drive);
    assert_eq!((drive.format(), drive.summary().camera), (Format::KittiRaw, Some(2)));
    assert_eq!(drive.timestamps_ns().collect::<Vec<_>>(), [0, 103_500_000, 200_000_000]);
    assert_eq!((drive.camera().unwrap().fx, drive.calibration().unwrap().size), (700.0, Some((64, 48))));
}

#[test]
fn tum_sequences_bring_their_times() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("rgb")).unwrap();
    let list = folder.path().join("rgb.txt");
    for n in 0..3 {
        gray(n).save(folder.path().join(format!("rgb/{n}.png"))).unwrap();
    }
    let rows = "# color images\n# timestamp filename\n1305031102.175304 rgb/0.png\n1305031102.211214 rgb/1.png\n\
                1305031102.243211 rgb/2.png\n";
    std::fs::write(&list, rows).unwrap();
    std::fs::write(folder.path().join("calibration.toml"), TOML).unwrap();
    let drive = open(folder.path());
    assert_eq!((drive.format(), drive.assumed_fps()), (Format::Tum, None));
    let times: Vec<_> = drive.timestamps_ns().collect();
    assert_eq!(times, [1_305_031_102_175_304_000, 1_305_031_102_211_214_000, 1_305_031_102_243_211_000]);
    let frames: Vec<_> = drive.frames().map(Result::unwrap).collect();
    assert_eq!(frames[2].gray().as_raw(), gray(2).as_raw());
    // A picture that is listed and missing keeps its place; times that stand still are refused by their line.
    std::fs::remove_file(folder.path().join("rgb/1.png")).unwrap();
    let missing: Vec<_> = drive.frames().map(|f| f.is_err()).collect();
    assert_eq!(missing, [false, true, false]);
    std::fs::write(&list, rows.replace("102.243211", "102.211214")).unwrap();
    let (message, code) = refusal(folder.path(), &SequenceOptions::default());
    assert!(message.contains("rgb.txt") && message.contains('5') && code == 3, "{message}");
}

#[test]
fn names_that_are_times_are_times() {
    let folder = folder(&[]);
    let times = [1_403_636_579_763_555_584_i64, 1_403_636_579_813_555_456, 1_403_636_579_963_555_584];
    for time in times {
        gray(0).save(folder.path().join(format!("{time}.png"))).unwrap();
    }
    let drive = open(folder.path());
    assert_eq!(drive.timestamps_ns().collect::<Vec<_>>(), times);
    assert!(drive.summary().gaps.is_empty());
}

#[test]
fn other_image_files_and_turned_ones() {
    for ending in ["webp", "bmp", "tif", "TIFF"] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("calibration.toml"), TOML).unwrap();
        for n in 0..2 {
            let path = folder.path().join(format!("{n:06}.{ending}"));
            image::DynamicImage::ImageLuma8(gray(n)).into_rgb8().save(&path).unwrap();
        }
        let drive = open(folder.path());
        let frames: Vec<_> = drive.frames().map(Result::unwrap).collect();
        assert_eq!(frames.len(), 2, "{ending}");
        assert_eq!(frames[1].gray().as_raw(), gray(1).as_raw(), "{ending}");
    }
}

/// A JPEG with an APP1 segment after the start marker that says how the camera was held.
#[test]
fn pictures_that_ask_to_be_turned_are_refused() {
    for orientation in [3, 6, 8] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("calibration.toml"), TOML).unwrap();
        let content = [b"Exif\0\0", &tiff(&[(ORIENTATION, orientation)])[..]].concat();
        let exif = [&[0xff, 0xe1, 0, content.len() as u8 + 2], &content[..]].concat();
        for n in 0..2 {
            let path = folder.path().join(format!("{n:06}.jpg"));
            gray(n).save(&path).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            std::fs::write(&path, [&bytes[..2], &exif[..], &bytes[2..]].concat()).unwrap();
        }
        let (said, code) = refusal(folder.path(), &SequenceOptions::default());
        assert!(said.contains(&format!("EXIF orientation {orientation}")) && code == 3, "{said}");
    }
}

/// A directory of TIFF entries, all of 16 or 32 bits, at the start of a little-endian file.
fn tiff(entries: &[(u16, u32)]) -> Vec<u8> {
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    bytes.extend((entries.len() as u16).to_le_bytes());
    for (tag, value) in entries {
        bytes.extend(tag.to_le_bytes());
        // Kind 3 is a short, 4 a long; a short lies in the first half of its four bytes.
        bytes.extend(if *value > 0xffff { 4_u16 } else { 3 }.to_le_bytes());
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend([0; 4]);
    bytes
}

/// Tag of the orientation; 1 is upright.
const ORIENTATION: u16 = 274;

/// A grey picture of 64 × 48 px as a file of this kind that asks to be shown turned.
fn turned(ending: &str, orientation: u32) -> Vec<u8> {
    use image::{ExtendedColorType, ImageEncoder};
    if ending == "tif" {
        // Width, height, bits, compression, black is zero, place, orientation, samples, rows and bytes of the strip.
        let entries = |place| {
            let end = [(277, 1), (278, 48), (279, 64 * 48)];
            [
                &[
                    (256, 64),
                    (257, 48),
                    (258, 8),
                    (259, 1),
                    (262, 1),
                    (273, place),
                    (ORIENTATION, orientation),
                ],
                &end[..],
            ]
            .concat()
        };
        let place = tiff(&entries(0)).len() as u32;
        return [tiff(&entries(place)), vec![7; 64 * 48]].concat();
    }
    let (mut bytes, exif) = (Vec::new(), tiff(&[(ORIENTATION, orientation)]));
    if ending == "png" {
        let mut encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        encoder.set_exif_metadata(exif).unwrap();
        encoder.write_image(&[7; 64 * 48], 64, 48, ExtendedColorType::L8).unwrap();
    } else {
        let mut encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut bytes);
        encoder.set_exif_metadata(exif).unwrap();
        encoder.write_image(&[7; 64 * 48], 64, 48, ExtendedColorType::L8).unwrap();
    }
    bytes
}

#[test]
fn turned_pictures_of_other_kinds_are_refused_first_or_later() {
    for (ending, orientation) in [("png", 8), ("webp", 3), ("tif", 6)] {
        let folder = folder(&[]);
        let write = |number: u64, orientation: u32| {
            let path = folder.path().join(format!("{number:06}.{ending}"));
            std::fs::write(path, turned(ending, orientation)).unwrap();
        };
        let named = format!("EXIF orientation {orientation}");
        // Upright is no turn, and a turned picture after the first is one frame that does not read.
        write(0, 1);
        write(1, orientation);
        write(2, 1);
        let frames: Vec<_> = open(folder.path()).frames().collect();
        let first = frames[0].as_ref().unwrap();
        assert_eq!((frames.len(), first.gray().get_pixel(9, 9).0[0]), (3, 7), "{ending}");
        let bad = frames[1].as_ref().unwrap_err().to_string();
        assert!(bad.contains(&format!("000001.{ending}")) && bad.contains(&named), "{bad}");
        assert!(frames[2].is_ok(), "{ending}");
        write(0, orientation);
        let (message, code) = refusal(folder.path(), &SequenceOptions::default());
        assert!(message.contains(&named) && message.contains("calibrate") && code == 3, "{message}");
    }
}
