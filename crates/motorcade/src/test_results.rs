//! A small result, for tests of what is made of one.

use motorcade_dataset::{Format, Summary};
use motorcade_geometry::{PinholeCamera, Pose};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{Dimensions, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::closed_loop::Loops;
use crate::config::Config;
use crate::finite;
use crate::output::RunContext;
use crate::record::FrameInfo;
use crate::result::RunResult;
use crate::timing::Stopwatch;

const CAMERA: PinholeCamera = PinholeCamera { fx: 60.0, fy: 60.0, cx: 39.5, cy: 29.5, width: 80, height: 60 };

/// A drive straight on at 10 m/s and ten frames a second.
pub(crate) fn result(frames: usize, vehicles: Vec<VehicleTrajectory>) -> RunResult {
    let info = |k: usize| FrameInfo { number: k as u64, timestamp_ns: k as i64 * 100_000_000, problem: None };
    let ego = |k: usize| EgoFrame {
        world_from_camera: Pose::from_parts(UnitQuaternion::identity(), Vector3::z() * k as f64),
        ..finite::tests::frame()
    };
    RunResult {
        camera: CAMERA,
        frames: (0..frames).map(info).collect(),
        ego: EgoTrajectory { frames: (0..frames).map(ego).collect(), height_m: 1.6, noise: Vec::new() },
        speeds_mps: None,
        road_measurements: Vec::new(),
        road_measurement_count: 0,
        vehicles,
        graph: None,
        graph_report: None,
        loops: Loops::default(),
        detections: vec![Vec::new(); frames],
        detects_vehicles: true,
        stopwatch: Stopwatch::default(),
        fixed_regions: Vec::new(),
        focal_by_turns: None,
        warnings: Vec::new(),
        interrupted: false,
        failed: false,
        planned_frames: None,
    }
}

/// A car whose states are in the first frames, one each.
pub(crate) fn vehicle(id: usize, states: Vec<VehicleState>) -> VehicleTrajectory {
    let states = states.into_iter().enumerate().map(|(frame, state)| VehicleState { frame, ..state });
    VehicleTrajectory {
        id,
        class: VehicleClass::Car,
        size: Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 },
        size_covariance: Matrix3::identity(),
        size_by_road: None,
        p_moving: 0.0,
        states: states.collect(),
    }
}

/// A run with the default settings.
pub(crate) fn context() -> RunContext {
    let input = Summary {
        format: Format::Images,
        sequence: None,
        camera: None,
        frames: 0,
        numbers: (0, 0),
        duration_s: 0.0,
        interval_s: 0.1,
        intervals_s: (0.1, 0.1),
        assumed_fps: None,
        width: CAMERA.width,
        height: CAMERA.height,
        rotation_deg: None,
        colour: false,
        calibration: None,
        intrinsics_px: None,
        distortion: None,
        lens: None,
        camera_from_cam0_m: [0.0; 3],
        gaps: Vec::new(),
        duplicates: Vec::new(),
        unnumbered: Vec::new(),
        input_hash: String::new(),
    };
    RunContext {
        config: Config::default(),
        camera_from_cam0: Pose::identity(),
        input,
        perception: ("none".to_owned(), "none".to_owned()),
        command: Vec::new(),
        fingerprint: None,
    }
}
