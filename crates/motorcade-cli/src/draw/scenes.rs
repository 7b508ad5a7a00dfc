//! Estimates of a run as they are drawn.

use motorcade::{RecordedFrame, RecordedRun, RecordedState, RecordedVehicle};
use motorcade_draw::{Road, Scene, SceneVehicle};
use motorcade_geometry::{Camera, Pose, Vehicle};
use motorcade_viewer::{MOVING, hue};
use nalgebra::{Matrix3, Matrix3x6, Point3, Vector3};

/// Length of the trail behind a moving vehicle \[ns\].
const TRAIL_NS: i64 = 3_000_000_000;
/// Least standard deviation relative to the camera, as a share of that in the world.
const LEAST_SHARE: f64 = 0.1;

/// The scenes of a run.
pub struct Scenes {
    run: RecordedRun,
    height_m: f64,
    /// Vehicle and state, by row.
    states: Vec<Vec<(usize, usize)>>,
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
        Self { run, height_m, states }
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
            // The direction of a step is known far better than its length.
            speed_sigma_mps: Some(frame.speed_mps * frame.scale_sigma_rel),
            road: Road { normal_in_camera: frame.road_normal, height_m: self.height_m },
            vehicles,
        })
    }

    fn vehicle(&self, frame: &RecordedFrame, (v, s): (usize, usize)) -> Option<SceneVehicle> {
        let vehicle = self.run.vehicles.get(v)?;
        let state = vehicle.states.get(s)?;
        let camera_from_vehicle = frame.world_from_camera.inverse() * state.world_from_vehicle;
        let moving = vehicle.p_moving > MOVING;
        Some(SceneVehicle {
            id: vehicle.id,
            class: vehicle.class.clone(),
            hue_deg: hue(v),
            camera_from_vehicle,
            size_m: vehicle.size_m,
            sigma_m: relative_sigma_m(frame, &camera_from_vehicle, state),
            speed_mps: state.speed_mps,
            moving,
            predicted: state.predicted,
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

/// Standard deviations of a vehicle's position relative to the camera, along its forward and left axes \[m\]. Tables hold those in the
/// world, which contain the drift of the camera since the first frame: Σ_world = Σ_relative + J Σ_camera Jᵀ.
fn relative_sigma_m(
    frame: &RecordedFrame,
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    state: &RecordedState,
) -> [f64; 2] {
    // A point p of the camera moves by ν + ω × p in it: J = [−[p]× | I].
    let p = camera_from_vehicle.translation();
    let mut jacobian = Matrix3x6::zeros();
    jacobian.fixed_columns_mut::<3>(0).copy_from(&-p.cross_matrix());
    jacobian.fixed_columns_mut::<3>(3).copy_from(&Matrix3::identity());
    let by_camera = jacobian * frame.covariance * jacobian.transpose();
    [(0, Vector3::x()), (1, Vector3::y())].map(|(k, axis): (usize, Vector3<f64>)| {
        let direction = camera_from_vehicle.transform_vector(&axis);
        let world = state.sigma_m[k] * state.sigma_m[k];
        let least = LEAST_SHARE * LEAST_SHARE * world;
        (world - direction.dot(&(by_camera * direction))).max(least).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::World;
    use nalgebra::Matrix6;

    #[test]
    fn the_drift_of_the_camera_is_left_out() {
        // Heading along the view, 20 m ahead; the camera 0.3 m uncertain along its axis and 0.01 rad about the vertical.
        let rotation = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
        let pose = Pose::<World, Vehicle>::from_matrix(&rotation, &Vector3::new(0.0, 1.5, 20.0));
        let mut covariance = Matrix6::zeros();
        covariance[(5, 5)] = 0.09;
        covariance[(1, 1)] = 1e-4;
        let frame = RecordedFrame {
            number: 0,
            timestamp_ns: 0,
            status: "tracked".into(),
            speed_mps: 0.0,
            scale_sigma_rel: 0.0,
            road_normal: -Vector3::y(),
            world_from_camera: Pose::identity(),
            covariance,
        };
        let state = |sigma_m| RecordedState {
            row: 0,
            world_from_vehicle: pose,
            speed_mps: 0.0,
            sigma_m,
            predicted: false,
        };
        let [forward, left] = relative_sigma_m(&frame, &pose.cast(), &state([0.5, 0.25, 0.0]));
        assert!((forward - 0.4).abs() < 1e-9, "{forward}");
        assert!((left - 0.15).abs() < 1e-9, "20 m at 0.01 rad are 0.2 m: {left}");
        // Known better in the world than the camera is: not nothing.
        let [forward, _] = relative_sigma_m(&frame, &pose.cast(), &state([0.2, 0.25, 0.0]));
        assert!((forward - 0.02).abs() < 1e-9, "{forward}");
    }
}
