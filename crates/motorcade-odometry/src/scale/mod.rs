//! Metres: scale and tilt of the road over time, the metric trajectory and its covariance.

mod ego_frame;
mod ego_trajectory;
mod kalman;
mod options;
mod scale_measurement;
mod segment_states;
mod smoother;
mod state;
mod steps;
mod uncertainty;

pub use ego_frame::EgoFrame;
pub use ego_trajectory::EgoTrajectory;
pub use options::{MetricOptions, SmootherOptions};
pub use scale_measurement::ScaleMeasurement;
pub use state::NoiseModel;
pub use uncertainty::Uncertainty;
