//! The estimate of the newest frame.

use std::io::{self, Write};

use motorcade_geometry::Pose;
use motorcade_odometry::EgoFrame;
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{Dimensions, VehicleState};
use nalgebra::{Matrix3, Matrix6};
use serde_json::{Value, json};

use crate::output::{TrackRow, TrackTable, status_name};
use crate::record::FrameInfo;

/// Camera, road and vehicles in the newest frame, from it and the frames before it alone.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The frame.
    pub frame: FrameInfo,
    /// Pose of the camera in the world with covariance and status, metric scale, road.
    pub ego: EgoFrame,
    /// Speed of the camera over the last frame interval \[m/s\], both ends at the newest scale; 0 in the first frame. The difference of the
    /// poses reported earlier can be larger: a new scale moves the window.
    pub speed_mps: f64,
    /// Vehicles seen in the frame, by identity.
    pub vehicles: Vec<VehicleEstimate>,
}

/// A vehicle in the newest frame.
#[derive(Clone, Debug)]
pub struct VehicleEstimate {
    /// Identity, the same over the drive.
    pub id: usize,
    /// Kind of vehicle.
    pub class: VehicleClass,
    /// Size.
    pub size: Dimensions,
    /// Covariance of length, width and height \[m²\].
    pub size_covariance: Matrix3<f64>,
    /// Probability that it moves.
    pub p_moving: f64,
    /// Pose in the world with covariance, speed, yaw rate.
    pub state: VehicleState,
}

impl VehicleEstimate {
    /// Standard deviations of length, width and height \[m\].
    pub fn size_sigma(&self) -> Dimensions {
        Dimensions::from_vector(&self.size_covariance.diagonal().map(|v| v.max(0.0).sqrt()))
    }
}

impl Estimate {
    /// Adds the vehicles to a table: poses in the world as they are known in this frame, sizes and P(moving) too.
    ///
    /// # Errors
    /// Those of the table's output.
    pub fn add_to<W: Write>(&self, table: &mut TrackTable<W>) -> io::Result<()> {
        for vehicle in &self.vehicles {
            table.write(&TrackRow {
                frame: &self.frame,
                camera: &self.ego,
                id: vehicle.id,
                class: vehicle.class,
                sizes: [vehicle.size, vehicle.size_sigma()],
                p_moving: vehicle.p_moving,
                state: &vehicle.state,
            })?;
        }
        table.flush()
    }

    /// One line of JSON: `frame`, `time_s`, `status`, `camera` and `vehicles` with poses in the world of the first camera
    /// (metres, quaternion x, y, z, w), sizes, speeds and standard deviations.
    pub fn to_json(&self) -> String {
        let mut camera = pose(&self.ego.world_from_camera, &self.ego.covariance);
        camera["speed_mps"] = json!(rounded(self.speed_mps));
        let vehicles: Vec<Value> = self.vehicles.iter().map(vehicle).collect();
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

fn vehicle(vehicle: &VehicleEstimate) -> Value {
    let (state, size, sigma) = (&vehicle.state, vehicle.size, vehicle.size_sigma());
    let mut out = pose(&state.world_from_vehicle, &state.covariance);
    out["id"] = json!(vehicle.id);
    out["class"] = json!(vehicle.class.name());
    out["size_m"] = Value::from([size.length_m, size.width_m, size.height_m].map(rounded).to_vec());
    out["size_sigma_m"] = Value::from([sigma.length_m, sigma.width_m, sigma.height_m].map(rounded).to_vec());
    out["speed_mps"] = json!(rounded(state.speed_mps));
    out["yaw_rate_radps"] = json!(rounded(state.yaw_rate_radps));
    out["p_moving"] = json!(rounded(vehicle.p_moving));
    out
}

/// Position, orientation, and standard deviations along the axes of the body itself.
pub(crate) fn pose<To, From>(pose: &Pose<To, From>, covariance: &Matrix6<f64>) -> Value {
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
pub(crate) fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6 + 0.0
}
