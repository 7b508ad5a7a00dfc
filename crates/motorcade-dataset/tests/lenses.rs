//! Pictures of a street through wide lenses, read as a drive: the frames are those of a pinhole again.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::path::Path;

use image::{GrayImage, Luma};
use motorcade_dataset::{Calibration, Sequence, SequenceOptions};
use motorcade_geometry::{DistortedCamera, PinholeCamera};
use motorcade_testing::street_image::{StreetPose, street_image};

const SIZE: (u32, u32) = (480, 240);
const MATRIX: &str = "fx = 190.0\nfy = 190.0\ncx = 244.0\ncy = 117.0\n";
const FISHEYE: &str = "[distortion]\nmodel = \"fisheye\"\nk1 = -0.02\nk2 = 0.01\nk3 = -0.005\nk4 = 0.001\n";
const RATIONAL: &str = "[distortion]\nmodel = \"rational\"\nk1 = 0.1\nk4 = 0.4\nk5 = 0.02\n";

/// Value of an image between pixels, 0 outside.
fn bilinear(image: &GrayImage, x: f64, y: f64) -> f64 {
    let (width, height) = (f64::from(image.width() - 1), f64::from(image.height() - 1));
    if !(x >= 0.0 && y >= 0.0 && x < width && y < height) {
        return 0.0;
    }
    let at = |dx: u32, dy: u32| f64::from(image.get_pixel(x as u32 + dx, y as u32 + dy).0[0]);
    let (fx, fy) = (x.fract(), y.fract());
    (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
}

/// A street, four times as fine as `pinhole` and blurred to 1.5 of its pixels, so that resampling loses little.
fn fine_street(pinhole: &PinholeCamera, along_m: f64) -> GrayImage {
    let PinholeCamera { fx, fy, cx, cy, width, height } = *pinhole;
    let fine = PinholeCamera {
        fx: 4.0 * fx,
        fy: 4.0 * fy,
        cx: 4.0 * cx,
        cy: 4.0 * cy,
        width: 4 * width,
        height: 4 * height,
    };
    image::imageops::blur(&street_image(&fine, &StreetPose::along(along_m)), 6.0)
}

/// The pinhole's picture.
fn straight(fine: &GrayImage) -> GrayImage {
    GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| *fine.get_pixel(4 * x, 4 * y))
}

/// The picture through a lens without tangential part.
fn through_lens(fine: &GrayImage, pinhole: &PinholeCamera, lens: &DistortedCamera) -> GrayImage {
    let matrix = lens.matrix();
    GrayImage::from_fn(matrix.width, matrix.height, |x, y| {
        let (a, b) = ((f64::from(x) - matrix.cx) / matrix.fx, (f64::from(y) - matrix.cy) / matrix.fy);
        let radius = a.hypot(b);
        let scale = if radius > 0.0 { lens.distortion().angle_rad(radius).tan() / radius } else { 1.0 };
        let (u, v) = (a * scale * pinhole.fx + pinhole.cx, b * scale * pinhole.fy + pinhole.cy);
        Luma([bilinear(fine, 4.0 * u, 4.0 * v).round() as u8])
    })
}

/// Root mean square difference of grey values in the middle half of the picture, the first image shifted.
fn middle_rms(a: &GrayImage, b: &GrayImage, shift: u32) -> f64 {
    let (width, height) = SIZE;
    let (rows, columns) = (height / 4..height * 3 / 4, width / 4..width * 3 / 4);
    let pixels = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    let squares: Vec<f64> = pixels
        .map(|(x, y)| f64::from(a.get_pixel(x + shift, y).0[0]) - f64::from(b.get_pixel(x, y).0[0]))
        .map(|difference| difference * difference)
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// A drive of two frames through the lens of a calibration, the straight frames and the pinhole.
fn drive(folder: &Path, calibration: &str) -> (Vec<GrayImage>, PinholeCamera) {
    let file = folder.join("calibration.toml");
    std::fs::write(&file, calibration).unwrap();
    let read = Calibration::read(&file, None).unwrap();
    let lens = read.distorted(&file, SIZE.0, SIZE.1).unwrap();
    let pinhole = read.pinhole(&file, SIZE.0, SIZE.1).unwrap();
    let streets = [3.0, 3.5].map(|along_m| fine_street(&pinhole, along_m));
    for (number, fine) in streets.iter().enumerate() {
        through_lens(fine, &pinhole, &lens).save(folder.join(format!("{number:06}.png"))).unwrap();
    }
    (streets.iter().map(straight).collect(), pinhole)
}

#[test]
fn a_street_through_a_wide_lens_comes_back() {
    for lens in [FISHEYE, RATIONAL] {
        let folder = tempfile::tempdir().unwrap();
        let (straight, pinhole) = drive(folder.path(), &format!("{MATRIX}{lens}"));
        let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
        assert_eq!(sequence.camera().unwrap(), pinhole);
        for (frame, expected) in sequence.frames().zip(&straight) {
            let frame = frame.unwrap();
            let (same, shifted) =
                (middle_rms(&frame.gray(), expected, 0), middle_rms(&frame.gray(), expected, 1));
            println!("{same:.2} grey values rms in the middle, {shifted:.2} one pixel beside");
            assert!(same < 1.5 && shifted > 4.0 * same, "{lens}: {same} {shifted}");
        }
    }
}

#[test]
fn the_summary_names_the_lens_and_the_pinhole() {
    let folder = tempfile::tempdir().unwrap();
    drive(folder.path(), &format!("{MATRIX}view_deg = 80.0\n{FISHEYE}"));
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let camera = sequence.camera().unwrap();
    assert!((camera.field_of_view_rad().0.to_degrees() - 80.0).abs() < 1e-9);
    let summary = sequence.summary();
    assert_eq!(summary.intrinsics_px, Some([camera.fx, camera.fy, 239.5, 119.5]));
    assert_eq!(summary.distortion.as_deref(), Some([-0.02, 0.01, -0.005, 0.001].as_slice()));
    let lens = summary.lens.unwrap();
    assert_eq!((lens.model, lens.intrinsics_px), ("fisheye", [190.0, 190.0, 244.0, 117.0]));
    assert!((lens.view_deg.0 - 80.0).abs() < 1e-9);
}

#[test]
fn a_view_can_be_stated_for_every_lens() {
    let folder = tempfile::tempdir().unwrap();
    drive(folder.path(), &format!("{MATRIX}[distortion]\nk1 = -0.1\n"));
    let open = || Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let (plain, hash) = (open().camera().unwrap(), open().summary().input_hash);
    assert_eq!((plain.fx, plain.cx, open().summary().lens), (190.0, 244.0, None));
    drive(folder.path(), &format!("{MATRIX}view_deg = 60.0\n[distortion]\nk1 = -0.1\n"));
    assert!((open().camera().unwrap().field_of_view_rad().0.to_degrees() - 60.0).abs() < 1e-9);
    assert_ne!(open().summary().input_hash, hash);
}

#[test]
fn masks_go_through_the_lens_and_what_it_does_not_show_is_ignored() {
    let folder = tempfile::tempdir().unwrap();
    // The lens sees 145 degrees; 160 are asked for.
    let (_, pinhole) = drive(folder.path(), &format!("{MATRIX}view_deg = 160.0\n{FISHEYE}"));
    let masks = tempfile::tempdir().unwrap();
    // A bonnet: rows 200 and below of the frames as they come in.
    let bonnet = GrayImage::from_fn(SIZE.0, SIZE.1, |_, y| Luma([if y >= 200 { 255 } else { 0 }]));
    bonnet.save(masks.path().join("mask.png")).unwrap();
    let options =
        SequenceOptions { ignore: Some(masks.path().join("mask.png")), ..SequenceOptions::default() };
    let sequence = Sequence::open(folder.path(), &options).unwrap();
    let ignore = sequence.frames().next().unwrap().unwrap().ignore.unwrap();
    assert_eq!(ignore.get_pixel(0, 120).0[0], 255);
    assert_eq!(ignore.get_pixel(240, 120).0[0], 0);
    // The border of the bonnet below the principal point, by the model.
    let read = Calibration::read(&folder.path().join("calibration.toml"), None).unwrap();
    let angle = read.distortion.angle_rad((199.5 - 117.0) / 190.0);
    let row = angle.tan() * pinhole.fy + pinhole.cy;
    assert_eq!(ignore.get_pixel(240, row as u32 - 1).0[0], 0);
    assert_eq!(ignore.get_pixel(240, row as u32 + 2).0[0], 255);
}
