//! The output of the front end for a generated drive.

use motorcade::{Config, FrameInfo, FrontEndRecord, Settings, Stopwatch};
use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{ExternalTrajectoryOptions, OdometryTrajectory, RoadMeasurement, RoadState};
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
use motorcade_vehicles::{Dimensions, image_box, upright_pose};
use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

pub use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M as HEIGHT_M};

/// Settings for this camera.
pub fn settings(config: Config) -> Settings {
    Settings { config, ..Settings::new(CAMERA, HEIGHT_M) }
}

/// True pose of the camera in a frame, on a ring road of one kilometre.
pub fn pose(k: usize) -> Pose<World, Camera> {
    let radius = 1000.0 / std::f64::consts::TAU;
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), k as f64 / radius);
    let centre = Vector3::new(radius, 0.0, 0.0);
    Pose::from_parts(turn, centre - turn * centre)
}

/// Distance of the car ahead in a frame \[m\].
pub fn gap_m(k: usize) -> f64 {
    15.0 + 2.0 * (k as f64 / 40.0).sin()
}

/// A ring road of one kilometre, 10 m/s: a car ahead, and every 15 s another one parked beside the road.
pub fn drive(frames: usize) -> FrontEndRecord {
    let poses: Vec<_> = (0..frames).map(pose).collect();
    let detected = |bbox| Detection {
        bbox,
        score: 0.9,
        class: VehicleClass::Car,
        convention: BoxConvention::VisibleExtent,
        external_id: None,
        pixel_size: 1.0,
        road_below: None,
    };
    // The rear of the car ahead alone.
    let ahead = |ahead: f64| {
        let at = |x: f64, y: f64| (CAMERA.fx * x / ahead + CAMERA.cx, CAMERA.fy * y / ahead + CAMERA.cy);
        let ((x1, y1), (x2, y2)) = (at(-0.9, HEIGHT_M - 1.5), at(0.9, HEIGHT_M));
        detected(BoundingBox::new([x1, y1, x2, y2]))
    };
    let parked = |ahead: f64| {
        let pose = upright_pose(&Point3::new(4.0, HEIGHT_M, ahead), &Vector3::z(), &-Vector3::y());
        let (class, size) = (VehicleClass::Car, Dimensions { length_m: 4.2, width_m: 1.8, height_m: 1.5 });
        let bbox = image_box(&CAMERA, &pose, class, BoxConvention::VisibleExtent, &size)?;
        Some(detected(bbox.clipped(CAMERA.width, CAMERA.height)))
    };
    let seen = |k: usize| {
        let distance = 60.0 - (k % 150) as f64;
        let beside = (distance > 8.0).then(|| parked(distance)).flatten();
        std::iter::once(ahead(gap_m(k))).chain(beside).collect()
    };
    let timestamps_ns: Vec<i64> = (0..poses.len() as i64).map(|k| k * 100_000_000).collect();
    let measured = |k: usize| RoadMeasurement {
        frame: k,
        reference: k - 2,
        state: RoadState {
            log_inverse_height: -HEIGHT_M.ln() + 0.01 * (k as f64 * 0.7).sin(),
            pitch_rad: 0.003 * (k as f64).sin(),
            roll_rad: 0.0,
        },
        baseline: (poses[k].translation() - poses[k - 2].translation()).norm(),
        covariance: Matrix3::from_diagonal(&Vector3::new(1e-5, 1e-6, 1e-6)),
        curvature: None,
        agreement: 0.9,
        pixels: 4000,
    };
    let frame =
        |k: usize| FrameInfo { number: k as u64, timestamp_ns: k as i64 * 100_000_000, problem: None };
    FrontEndRecord {
        frames: (0..frames).map(frame).collect(),
        detections: (0..frames).map(seen).collect::<Vec<_>>().into(),
        keypoints: vec![Vec::new(); frames].into(),
        detects_vehicles: true,
        road_measurements: (2..frames).map(measured).collect(),
        motion: OdometryTrajectory::from_poses(&poses, &timestamps_ns, &ExternalTrajectoryOptions::default()),
        forgotten_measurements: 0,
        forgotten: false,
        places: Vec::new(),
        stopwatch: Stopwatch::default(),
        warnings: Vec::new(),
        interrupted: false,
        failed: false,
        planned_frames: None,
        fixed_regions: Vec::new(),
        focal_by_turns: None,
    }
}
