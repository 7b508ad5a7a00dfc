//! Errors of the camera's and the vehicles' trajectories against ground truth.
//!
//! [`evaluate_run`] compares a run directory with a KITTI tracking sequence and gives a [`Report`], which prints as a
//! table and serialises; [`evaluate`] does the same with [`Estimates`] in memory. [`evaluate_trajectory`] compares two lists of
//! poses, [`nees`] tests their covariances. Every absolute error names its alignment:
//! first poses identified, SE(3), or Sim(3), because they differ by an order of magnitude.
//!
//! ```
//! use motorcade_evaluate::evaluate_trajectory;
//! use motorcade_geometry::{Camera, Pose, World};
//! use nalgebra::{UnitQuaternion, Vector3};
//! let drive = |scale: f64| -> Vec<Pose<World, Camera>> {
//!     let position = |i: f64| Vector3::new(0.01 * i * i, 0.0, i) * scale;
//!     (0..50).map(|i| Pose::from_parts(UnitQuaternion::identity(), position(f64::from(i)))).collect()
//! };
//! let report = evaluate_trajectory(&drive(0.98), &drive(1.0))?;
//! assert!((report.best_scale.unwrap() - 1.0 / 0.98).abs() < 1e-9);
//! assert!(report.ate_sim3_m.unwrap() < 1e-9 && report.ate_origin_m > 0.5);
//! # Ok::<(), motorcade_evaluate::Error>(())
//! ```

mod assignment;
mod boxes3d;
mod cuboid;
mod deviations;
mod drive;
mod ego;
mod error;
mod estimates;
mod ground_truth;
mod matching;
mod moving;
mod nees;
mod run;
mod statistics;
mod table;
mod tracking;
mod vehicle_nees;
mod vehicles;

pub use boxes3d::{AveragePrecision, Boxes3dReport};
pub use deviations::VehicleDeviations;
pub use ego::{EgoReport, ScalePoint, evaluate_trajectory};
pub use error::{Error, Result};
pub use estimates::Estimates;
pub use ground_truth::GroundTruth;
pub use moving::{MovingReport, MovingRow};
pub use nees::{ConsistencyReport, evaluate_consistency, nees};
pub use run::{Report, evaluate, evaluate_run};
pub use tracking::{Tracking2dReport, Tracking3d, Tracking3dReport};
pub use vehicle_nees::{NeesReport, VehicleConsistency};
pub use vehicles::{VehicleMeans, VehicleReport};
