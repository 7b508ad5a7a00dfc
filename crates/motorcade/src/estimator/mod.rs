//! The estimator: from what the front end knows to metric trajectories of camera and vehicles.
//!
//! One estimator over two windows. [`drive`] takes the whole drive, [`sliding`] the last seconds after every frame; both go
//! through the same steps: metric trajectory, [`loops`] in a drive and [`online_loops`] beside the last seconds, [`vehicles`], [`unit`] of an external trajectory, multi-object graph. At high frame
//! rates the last seconds are estimated every few frames, and [`prediction`] covers those between.

mod camera_height;
mod distances;
pub(crate) mod drive;
mod ego_archive;
mod loops;
mod online_loops;
mod place_edges;
pub(crate) mod prediction;
mod remembered;
pub(crate) mod sliding;
pub(crate) mod unit;
mod vehicle_archive;
pub(crate) mod vehicles;

pub use drive::estimate_drive;
pub use sliding::SlidingEstimator;
pub(crate) use sliding::SlidingState;
