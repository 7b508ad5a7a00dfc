//! Time to draw a frame with twelve vehicles on one thread, at KITTI's size and at 1280×720: `cargo run --release -p motorcade-draw --example draw_time`.

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::time::Instant;

use image::{Rgb, RgbImage};
use motorcade_draw::{Overlay, Scene, SceneVehicle};
use motorcade_geometry::{PinholeCamera, Pose, RoadPlane};
use nalgebra::{Matrix3, Point3, Vector3};

/// Frames drawn.
const FRAMES: u32 = 200;

fn main() {
    for (width, height, focal) in [(1242, 375, 721.5), (1280, 720, 1000.0)] {
        let (cx, cy) = (0.5 * f64::from(width), 0.45 * f64::from(height));
        let camera = PinholeCamera { fx: focal, fy: focal, cx, cy, width, height };
        let frame = RgbImage::from_fn(width, height, |x, y| Rgb([(x % 256) as u8, (y % 256) as u8, 90]));
        let overlay = Overlay::new(camera);
        let scene = Scene {
            number: 0,
            time_s: 0.0,
            status: None,
            speed_mps: 12.0,
            speed_sigma_mps: Some(0.2),
            road: RoadPlane::level(1.65),
            vehicles: (0..12).map(vehicle).collect(),
        };
        let start = Instant::now();
        let mut sum = 0_u64;
        for _ in 0..FRAMES {
            sum += overlay.draw(&frame, &scene).iter().step_by(97).map(|v| u64::from(*v)).sum::<u64>();
        }
        let ms = start.elapsed().as_secs_f64() * 1e3 / f64::from(FRAMES);
        println!("{width}x{height}: {ms:.2} ms a frame, {:.0} frames/s (checksum {sum})", 1e3 / ms);
    }
}

/// Vehicles in two rows, from 7 to 50 m ahead, every second one moving with a trail.
fn vehicle(k: u32) -> SceneVehicle {
    let (right, ahead) = (if k.is_multiple_of(2) { -3.5 } else { 3.0 }, 7.0 + 4.0 * f64::from(k));
    let rotation = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    let trail = |age: i32| Point3::new(right, 1.65, ahead - f64::from(age));
    SceneVehicle {
        id: u64::from(k),
        class: "Car".into(),
        hue_deg: 30 * k,
        camera_from_vehicle: Pose::from_matrix(&rotation, &Vector3::new(right, 1.65, ahead)),
        size_m: [4.2, 1.8, 1.5],
        sigma_m: [0.02 * ahead, 0.1],
        speed_mps: 10.0,
        moving: k.is_multiple_of(2),
        unsure: false,
        faint: false,
        trail_in_camera: if k.is_multiple_of(2) { (0..30).rev().map(trail).collect() } else { Vec::new() },
    }
}
