//! Estimates of a run as they are drawn.

use motorcade::{RecordedFrame, RecordedRun, RecordedState, RecordedVehicle, relative_sigma_m};
use motorcade_draw::{Scene, SceneVehicle};
use motorcade_geometry::RoadPlane;
use motorcade_viewer::{MOVING, hue, is_doubtful, is_unsure};
use nalgebra::Point3;

/// Length of the trail behind a moving vehicle \[ns\].
const TRAIL_NS: i64 = 3_000_000_000;

/// The scenes of a run.
pub struct Scenes {
    run: RecordedRun,
    height_m: f64,
    /// Vehicle and state, by row.
    states: Vec<Vec<(usize, usize)>>,
    /// For each vehicle whether the detector doubts it.
    doubtful: Vec<bool>,
}

impl Scenes {
    pub fn new(run: RecordedRun, height_m: f64) -> Self {
        let mut states = vec![Vec::new(); run.frames.len()];
        for (v, vehicle) in run.vehicles.iter().enumerate() {
            for (s, state) in vehicle.states.iter().enumerate() {
                if let Some(row) = states.get_mut(state.row) {
                    row.push((v, s));
                }
            }
        }
        let seen =
            |v: &RecordedVehicle| is_doubtful(v.states.iter().filter(|s| !s.predicted).map(|s| s.score));
        let doubtful = run.vehicles.iter().map(seen).collect();
        Self { run, height_m, states, doubtful }
    }

    /// The run.
    pub fn run(&self) -> &RecordedRun {
        &self.run
    }

    /// The scene of the frame with this number; `None` where the run does not have it.
    pub fn scene(&self, number: u64) -> Option<Scene> {
        let row = self.run.row(number)?;
        let frame = self.run.frames.get(row)?;
        let start_ns = self.run.frames.first()?.timestamp_ns;
        let known = ["tracked", "standstill"].contains(&frame.status.as_str());
        let vehicles = self.states.get(row)?.iter().filter_map(|at| self.vehicle(frame, *at)).collect();
        Some(Scene {
            number,
            time_s: (frame.timestamp_ns - start_ns) as f64 * 1e-9,
            status: (!known).then(|| frame.status.replace('_', " ")),
            speed_mps: frame.speed_mps,
            speed_sigma_mps: frame.speed_sigma_mps,
            road: RoadPlane { up: frame.road_normal, height_m: self.height_m },
            vehicles,
        })
    }

    fn vehicle(&self, frame: &RecordedFrame, (v, s): (usize, usize)) -> Option<SceneVehicle> {
        let vehicle = self.run.vehicles.get(v)?;
        let state = vehicle.states.get(s)?;
        let camera_from_vehicle = frame.world_from_camera.inverse() * state.world_from_vehicle;
        let [forward, left, _] = relative_sigma_m(&camera_from_vehicle, &frame.covariance, state.sigma_m);
        let moving = vehicle.p_moving > MOVING;
        Some(SceneVehicle {
            id: vehicle.id,
            class: vehicle.class.clone(),
            hue_deg: hue(v),
            camera_from_vehicle,
            size_m: vehicle.size_m,
            sigma_m: [forward, left],
            speed_mps: state.speed_mps,
            moving,
            unsure: is_unsure(vehicle.p_moving),
            faint: state.predicted || self.doubtful.get(v).copied().unwrap_or(false),
            trail_in_camera: if moving { self.trail(frame, vehicle, s) } else { Vec::new() },
        })
    }

    /// Positions of the last seconds up to a state, in the camera of its frame.
    fn trail(&self, frame: &RecordedFrame, vehicle: &RecordedVehicle, last: usize) -> Vec<Point3<f64>> {
        let camera_from_world = frame.world_from_camera.inverse();
        let recent = |s: &&RecordedState| {
            self.run.frames.get(s.row).is_some_and(|f| frame.timestamp_ns - f.timestamp_ns <= TRAIL_NS)
        };
        let states = vehicle.states.get(..=last).unwrap_or_default().iter().filter(recent);
        let place = |s: &RecordedState| Point3::from(s.world_from_vehicle.translation());
        states.map(|s| camera_from_world.transform_point(&place(s))).collect()
    }
}
