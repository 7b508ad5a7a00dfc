//! Metres: the scale and tilt of the road over time, the metric trajectory and its covariance.

mod ego_trajectory;
mod smoother;
mod uncertainty;

pub use ego_trajectory::{EgoFrame, EgoTrajectory};
pub use smoother::NoiseModel;
pub use uncertainty::Uncertainty;
