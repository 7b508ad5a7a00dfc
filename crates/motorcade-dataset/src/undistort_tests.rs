use super::*;
use motorcade_geometry::{Distortion, Fisheye, RadialTangential, Rational};

#[allow(dead_code, reason = "written for the tests of motorcade-geometry, which compare points too")]
#[path = "../../motorcade-geometry/tests/opencv_values/mod.rs"]
mod opencv_values;

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

/// Largest difference of the table from OpenCV's \[px\], and how many of the pixels lie in the source.
fn from_opencv(matrix: PinholeCamera, distortion: Distortion, rows: &[[f64; 4]]) -> (f64, usize) {
    let table = table(matrix, distortion);
    let (mut largest, mut inside) = (0.0_f64, 0);
    for [x, y, u, v] in rows {
        let found = table.source[*y as usize * matrix.width as usize + *x as usize];
        let (last_x, last_y) = (f64::from(matrix.width - 1), f64::from(matrix.height - 1));
        if (0.0..=last_x).contains(u) && (0.0..=last_y).contains(v) {
            inside += 1;
            // NaN is no smaller than anything.
            let px = (f64::from(found[0]) - u).hypot(f64::from(found[1]) - v);
            largest = if px <= largest { largest } else { px };
        } else {
            assert!(found[0].is_nan(), "({x}, {y}) has no source: {found:?}");
        }
    }
    (largest, inside)
}

/// The lenses of motorcade-geometry/tests/opencv.rs, values by scripts/opencv_distortion.py.
#[test]
fn tables_are_those_of_opencv() {
    use opencv_values::{EUROC_MAP, FISHEYE_MAP, KITTI_MAP, RATIONAL_MAP};
    let camera = |fx, fy, cx, cy, width, height| PinholeCamera { fx, fy, cx, cy, width, height };
    let rational = Distortion::Rational(Rational {
        k1: 0.54637021,
        k2: -2.6014142,
        p1: 0.00084511022,
        p2: -0.00037217003,
        k3: 1.4684651,
        k4: 0.42450839,
        k5: -2.430366,
        k6: 1.4001946,
    });
    let fisheye =
        Distortion::Fisheye(Fisheye { k1: -0.00530046, k2: 0.0423333, k3: -0.0394988, k4: 0.00682388 });
    for (matrix, distortion, rows) in [
        (
            camera(458.654, 457.296, 367.215, 248.375, 752, 480),
            radial(-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0),
            EUROC_MAP,
        ),
        (
            camera(984.2439, 980.8141, 690.0, 233.1966, 1392, 512),
            radial(-0.3728755, 0.2037299, 0.002219027, 0.001383707, -0.07233722),
            KITTI_MAP,
        ),
        (camera(611.902, 611.78, 637.032, 369.051, 1280, 720), rational, RATIONAL_MAP),
        (camera(284.9502, 285.1153, 420.5002, 400.7381, 848, 800), fisheye, FISHEYE_MAP),
    ] {
        let (px, inside) = from_opencv(matrix, distortion, &rows);
        println!("{}: {inside} pixels within {px:.1e} px", distortion.model());
        // Of the rational lens the source shows the middle alone.
        assert!(px < 1e-3 && inside >= 9, "{distortion:?}: {px:e} px of {inside}");
    }
}

/// Between pixels a ramp is a ramp: bilinear reading gives the place it is read at.
#[test]
fn pixels_are_read_at_the_place_of_the_table() {
    let table = table(CAMERA, Distortion::Fisheye(Fisheye { k1: 0.02, ..Default::default() }));
    for (axis, slope) in [(0, 3.0), (1, 4.0)] {
        let raw = GrayImage::from_fn(80, 60, |x, y| image::Luma([[3 * x, 4 * y][axis] as u8]));
        let Pixels::Gray(read) = table.pixels(&Pixels::Gray(raw)) else { panic!("stays grey") };
        let mut compared = 0;
        for (pixel, source) in read.pixels().zip(&table.source).filter(|(_, source)| !source[0].is_nan()) {
            let difference = f32::from(pixel.0[0]) - slope * source[axis];
            assert!(difference.abs() <= 0.501, "{difference} at {source:?}");
            compared += 1;
        }
        assert!(compared > 2000, "{compared}");
    }
}
