//! What an online run tells of the newest frame.

use motorcade_geometry::Pose;
use motorcade_odometry::EgoFrame;
use motorcade_vehicles::VehicleTrajectory;
use nalgebra::Matrix6;
use serde_json::{Value, json};

use crate::output::status_name;
use crate::result::FrameInfo;

/// Camera and vehicles in the newest frame, as known when it came.
pub struct OnlineEstimate<'a> {
    /// The frame.
    pub frame: &'a FrameInfo,
    /// The camera.
    pub ego: &'a EgoFrame,
    /// The frame before and its camera.
    pub before: Option<(&'a FrameInfo, &'a EgoFrame)>,
    /// Vehicles seen in it; the last state of each is that of this frame.
    pub vehicles: Vec<&'a VehicleTrajectory>,
}

impl OnlineEstimate<'_> {
    /// Speed of the camera \[m/s\]; 0 in the first frame.
    pub fn speed_mps(&self) -> f64 {
        let Some((frame, ego)) = self.before else { return 0.0 };
        let way = self.ego.world_from_camera.translation() - ego.world_from_camera.translation();
        let seconds = (self.frame.timestamp_ns - frame.timestamp_ns) as f64 * 1e-9;
        if seconds > 0.0 { way.norm() / seconds } else { 0.0 }
    }

    /// One line of JSON: `frame`, `time_s`, `status`, `camera` and `vehicles` with poses in the world of the first camera
    /// (metres, quaternion x, y, z, w), sizes, speeds and standard deviations.
    pub fn to_json(&self) -> String {
        let mut camera = pose(&self.ego.world_from_camera, &self.ego.covariance);
        camera["speed_mps"] = json!(rounded(self.speed_mps()));
        let vehicles: Vec<Value> = self.vehicles.iter().filter_map(|v| vehicle(v)).collect();
        json!({
            "frame": self.frame.number,
            "time_s": rounded(self.frame.timestamp_ns as f64 * 1e-9),
            "status": status_name(self.ego.status),
            "camera": camera,
            "vehicles": vehicles,
        })
        .to_string()
    }
}

fn vehicle(vehicle: &VehicleTrajectory) -> Option<Value> {
    let state = vehicle.states.last()?;
    let (size, size_sigma) = (vehicle.size, vehicle.size_sigma());
    let mut out = pose(&state.world_from_vehicle, &state.covariance);
    out["id"] = json!(vehicle.id);
    out["class"] = json!(vehicle.class.name());
    out["size_m"] = Value::from([size.length_m, size.width_m, size.height_m].map(rounded).to_vec());
    out["size_sigma_m"] =
        Value::from([size_sigma.length_m, size_sigma.width_m, size_sigma.height_m].map(rounded).to_vec());
    out["speed_mps"] = json!(rounded(state.speed_mps));
    out["yaw_rate_radps"] = json!(rounded(state.yaw_rate_radps));
    out["p_moving"] = json!(rounded(vehicle.p_moving));
    Some(out)
}

/// Position, orientation, and standard deviations along the axes of the body itself.
fn pose<To, From>(pose: &Pose<To, From>, covariance: &Matrix6<f64>) -> Value {
    let (t, q) = (pose.translation(), pose.rotation());
    let sigma = |k: usize| rounded(covariance[(k, k)].max(0.0).sqrt());
    json!({
        "position_m": ([t.x, t.y, t.z].map(rounded)),
        "orientation_xyzw": ([q.i, q.j, q.k, q.w].map(rounded)),
        "sigma_rad": ([0, 1, 2].map(sigma)),
        "sigma_m": ([3, 4, 5].map(sigma)),
    })
}

/// To a millionth, and never a minus before a zero.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6 + 0.0
}
