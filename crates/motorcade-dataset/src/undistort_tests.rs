use super::*;
use motorcade_geometry::{Distortion, Fisheye, RadialTangential, Rational};

const CAMERA: PinholeCamera = PinholeCamera { fx: 60.0, fy: 60.0, cx: 39.5, cy: 29.5, width: 80, height: 60 };

fn table(matrix: PinholeCamera, distortion: Distortion) -> Undistortion {
    let camera = DistortedCamera::new(matrix, distortion).unwrap();
    Undistortion::new(&camera, &camera.undistorted(None).unwrap())
}

fn radial(k1: f64, k2: f64, p1: f64, p2: f64, k3: f64) -> Distortion {
    Distortion::RadialTangential(RadialTangential { k1, k2, p1, p2, k3 })
}

#[test]
fn a_distorted_ramp_becomes_straight_again() {
    let distortion = radial(-0.2, 0.05, 0.001, -0.002, 0.0);
    // Value of a pixel = 2 x its undistorted column, found by inverting the model by fixed point.
    let raw = GrayImage::from_fn(80, 60, |x, y| {
        let (u, v) = ((f64::from(x) - 39.5) / 60.0, (f64::from(y) - 29.5) / 60.0);
        let (mut a, mut b) = (u, v);
        for _ in 0..50 {
            let (da, db) = distortion.distort(a, b);
            a += u - da;
            b += v - db;
        }
        image::Luma([(2.0 * (a * 60.0 + 39.5)).round().clamp(0.0, 255.0) as u8])
    });
    let Pixels::Gray(straight) = table(CAMERA, distortion).pixels(&Pixels::Gray(raw)) else {
        panic!("stays grey")
    };
    for y in 5..55 {
        for x in 5..75 {
            let value = f64::from(straight.get_pixel(x, y).0[0]);
            assert!((value - 2.0 * f64::from(x)).abs() <= 1.5, "({x}, {y}): {value}");
        }
    }
}

#[test]
fn pixels_from_outside_are_ignored() {
    let mask = table(CAMERA, radial(0.4, 0.0, 0.0, 0.0, 0.0)).mask(None).unwrap();
    assert_eq!(mask.get_pixel(0, 0).0[0], 255);
    assert_eq!(mask.get_pixel(40, 30).0[0], 0);
    assert!(table(CAMERA, Distortion::default()).mask(None).is_none());
}

/// FNV-1a of a table, with 0 for pixels without a source.
fn hash(table: &Undistortion) -> u64 {
    let values = table.source.iter().flatten().map(|v| if v.is_nan() { 0 } else { v.to_bits() });
    let bytes = values.flat_map(u32::to_le_bytes);
    bytes.fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn radial_tangential_tables_are_as_before_other_lenses() {
    // Hashes of the tables that were made before the end of the monotone part was looked at (commit 08b342c): EuRoC, KITTI
    // raw, TUM RGB-D.
    let camera = |fx, fy, cx, cy, width, height| PinholeCamera { fx, fy, cx, cy, width, height };
    for (matrix, distortion, expected) in [
        (
            camera(458.654, 457.296, 367.215, 248.375, 752, 480),
            radial(-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0),
            0x13a1_8d82_8e9f_8eb4_u64,
        ),
        (
            camera(984.2439, 980.8141, 690.0, 233.1966, 1392, 512),
            radial(-0.3728755, 0.2037299, 0.002219027, 0.001383707, -0.07233722),
            0x046f_180a_6d77_b4f0,
        ),
        (
            camera(517.306408, 516.469215, 318.643040, 255.313989, 640, 480),
            radial(0.262383, -0.953104, -0.005358, 0.002628, 1.163314),
            0x2699_14c2_3b33_7e92,
        ),
    ] {
        assert_eq!(hash(&table(matrix, distortion)), expected, "{distortion:?}");
    }
}

#[test]
fn beyond_the_monotone_part_there_is_no_ghost() {
    // Each turns back within the picture; none may show the same source twice along the middle row.
    for distortion in [
        radial(-0.6, 0.0, 0.0, 0.0, 0.0),
        Distortion::Rational(Rational { k4: 3.0, ..Default::default() }),
        Distortion::Fisheye(Fisheye { k1: -0.6, ..Default::default() }),
    ] {
        let wide = PinholeCamera { fx: 30.0, fy: 30.0, ..CAMERA };
        let camera = DistortedCamera::new(wide, distortion).unwrap();
        let target = PinholeCamera { fx: 25.0, fy: 25.0, ..CAMERA };
        let table = Undistortion::new(&camera, &target);
        let row: Vec<f32> = table.source[30 * 80..31 * 80].iter().map(|s| s[0]).collect();
        let seen: Vec<f32> = row.iter().copied().filter(|u| !u.is_nan()).collect();
        assert!(seen.len() > 20 && seen.len() < 80, "{distortion:?}: {seen:?}");
        assert!(seen.windows(2).all(|pair| pair[0] < pair[1]), "{distortion:?}: {seen:?}");
        assert!(row[0].is_nan() && row[79].is_nan(), "{distortion:?}");
    }
}
