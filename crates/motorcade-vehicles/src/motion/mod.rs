//! Motion of a vehicle: constant-velocity filter and smoother in the world, static position, P(moving).

mod filter;
mod kinematic_state;
mod line;
mod smoother;
mod static_position;

use nalgebra::{Matrix3, Matrix6, Vector3};

pub(crate) use filter::MotionFilter;
pub use kinematic_state::probability_moving;
pub(crate) use line::Line;
pub use smoother::smooth_motion;
pub use static_position::static_position;

/// A measured position.
#[derive(Clone, Copy, Debug)]
pub struct PositionMeasurement {
    /// Frame (row of the run).
    pub frame: usize,
    /// Time \[s\].
    pub time_s: f64,
    /// Position in the world \[m\].
    pub position: Vector3<f64>,
    /// Covariance (3×3) \[m²\].
    pub covariance: Matrix3<f64>,
    /// Distance from the camera \[m\].
    pub range_m: f64,
    /// Unit vector from the camera to it, world frame.
    pub toward: Vector3<f64>,
}

/// Position and velocity at a time.
#[derive(Clone, Copy, Debug)]
pub struct KinematicState {
    /// Position in the world \[m\].
    pub position: Vector3<f64>,
    /// Velocity in the world \[m/s\].
    pub velocity: Vector3<f64>,
    /// Covariance of both (6×6).
    pub covariance: Matrix6<f64>,
}
