//! Height of the camera above the road and tilt of the road.

use nalgebra::Vector3;

/// Height of the camera above the road, and the road's tilt relative to the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RoadState {
    /// Logarithm of 1 / camera height, in the odometry's unit; plus the logarithm of the height in metres it is the logarithm
    /// of the scale (metres per unit).
    pub log_inverse_height: f64,
    /// Pitch of the road relative to the camera \[rad\]; positive for a camera that looks down.
    pub pitch_rad: f64,
    /// Roll of the road relative to the camera \[rad\].
    pub roll_rad: f64,
}

impl RoadState {
    /// From `[log inverse height, pitch, roll]`.
    pub fn from_vector(v: &Vector3<f64>) -> Self {
        Self { log_inverse_height: v.x, pitch_rad: v.y, roll_rad: v.z }
    }

    /// `[log inverse height, pitch, roll]`.
    pub fn to_vector(&self) -> Vector3<f64> {
        Vector3::new(self.log_inverse_height, self.pitch_rad, self.roll_rad)
    }

    /// Camera height in the odometry's unit.
    pub fn height(&self) -> f64 {
        (-self.log_inverse_height).exp()
    }
}
