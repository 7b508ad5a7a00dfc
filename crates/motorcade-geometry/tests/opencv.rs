//! Distortion models against OpenCV's projectPoints and initUndistortRectifyMap, radial, rational and fisheye. The expected
//! values were printed by scripts/opencv_distortion.py.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

mod opencv_values;

use motorcade_geometry::{DistortedCamera, Distortion, Fisheye, PinholeCamera, RadialTangential, Rational};
use nalgebra::{Point2, Point3};
use opencv_values::*;

const EUROC: PinholeCamera =
    PinholeCamera { fx: 458.654, fy: 457.296, cx: 367.215, cy: 248.375, width: 752, height: 480 };
const EUROC_LENS: Distortion = Distortion::RadialTangential(RadialTangential {
    k1: -0.28340811,
    k2: 0.07395907,
    p1: 0.00019359,
    p2: 1.76187114e-05,
    k3: 0.0,
});
const KITTI: PinholeCamera =
    PinholeCamera { fx: 984.2439, fy: 980.8141, cx: 690.0, cy: 233.1966, width: 1392, height: 512 };
const KITTI_LENS: Distortion = Distortion::RadialTangential(RadialTangential {
    k1: -0.3728755,
    k2: 0.2037299,
    p1: 0.002219027,
    p2: 0.001383707,
    k3: -0.07233722,
});
const RATIONAL: PinholeCamera =
    PinholeCamera { fx: 611.902, fy: 611.78, cx: 637.032, cy: 369.051, width: 1280, height: 720 };
const RATIONAL_LENS: Distortion = Distortion::Rational(Rational {
    k1: 0.54637021,
    k2: -2.6014142,
    p1: 0.00084511022,
    p2: -0.00037217003,
    k3: 1.4684651,
    k4: 0.42450839,
    k5: -2.430366,
    k6: 1.4001946,
});
const FISHEYE: PinholeCamera =
    PinholeCamera { fx: 284.9502, fy: 285.1153, cx: 420.5002, cy: 400.7381, width: 848, height: 800 };
const FISHEYE_LENS: Distortion =
    Distortion::Fisheye(Fisheye { k1: -0.00530046, k2: 0.0423333, k3: -0.0394988, k4: 0.00682388 });

/// The tables hold nine digits.
const POINTS_PX: f64 = 1e-5;
/// OpenCV's maps are of single precision: 6e-5 px at 1000 px.
const MAP_PX: f64 = 2e-4;

/// Largest distance \[px\] over all rows.
fn largest(distances: impl Iterator<Item = f64>) -> f64 {
    distances.fold(0.0, |a, b| if a >= b { a } else { b })
}

fn points_px(camera: PinholeCamera, lens: Distortion, rows: &[[f64; 5]]) -> f64 {
    let camera = DistortedCamera::new(camera, lens).unwrap();
    largest(rows.iter().map(|[x, y, z, u, v]| {
        let pixel = camera.project(&Point3::new(*x, *y, *z)).unwrap();
        (pixel - Point2::new(*u, *v)).norm()
    }))
}

fn map_px(camera: PinholeCamera, lens: Distortion, rows: &[[f64; 4]]) -> f64 {
    let camera = DistortedCamera::new(camera, lens).unwrap();
    let target = camera.undistorted(None).unwrap();
    largest(rows.iter().map(|[x, y, u, v]| {
        let ray = target.ray(&Point2::new(*x, *y));
        (camera.pixel(ray.x, ray.y).unwrap() - Point2::new(*u, *v)).norm()
    }))
}

#[test]
fn points_are_projected_as_by_opencv() {
    for (name, camera, lens, rows) in [
        ("euroc", EUROC, EUROC_LENS, &EUROC_POINTS),
        ("kitti", KITTI, KITTI_LENS, &KITTI_POINTS),
        ("rational", RATIONAL, RATIONAL_LENS, &RATIONAL_POINTS),
        ("fisheye", FISHEYE, FISHEYE_LENS, &FISHEYE_POINTS),
    ] {
        let px = points_px(camera, lens, rows);
        println!("{name}: points within {px:.2e} px");
        assert!(px < POINTS_PX, "{name}: {px:e} px");
    }
}

#[test]
fn maps_are_those_of_opencv() {
    for (name, camera, lens, rows) in [
        ("euroc", EUROC, EUROC_LENS, &EUROC_MAP),
        ("kitti", KITTI, KITTI_LENS, &KITTI_MAP),
        ("rational", RATIONAL, RATIONAL_LENS, &RATIONAL_MAP),
        ("fisheye", FISHEYE, FISHEYE_LENS, &FISHEYE_MAP),
    ] {
        let px = map_px(camera, lens, rows);
        println!("{name}: map within {px:.2e} px");
        assert!(px < MAP_PX, "{name}: {px:e} px");
    }
}
