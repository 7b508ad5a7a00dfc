//! The multi-object graph: camera and vehicle poses optimised together (eqs. 9–14 of Nair et al., *Multi-object Monocular
//! SLAM for Dynamic Environments*, IV 2020).
//!
//! | edge | default | paper |
//! |---|---|---|
//! | camera–camera | odometry with its covariance | odometry, λ = constant |
//! | camera–camera | loops: relative poses of two visits of a place, with their covariance | – |
//! | camera–vehicle | each frame's box and keypoints, covariances with the scale of the size held, Cauchy | the pose of all sources together, λ high up to 45 m, low beyond |
//! | scale of the size | one variable a vehicle, shared by its camera–vehicle edges, with its prior | – |
//! | scale of distances | the same for poses of an external source, which assumed a size of its own | – |
//! | vehicle–vehicle | steady motion and no side slip | difference of road-plane positions, λ high beyond 45 m |
//!
//! Places seen again correct the camera's trajectory before vehicles are estimated on it ([`close_loops`]); their edges stand in the graph too.
//!
//! By default a static vehicle is one node, a landmark seen from many cameras. Landmarks correct the camera where odometry broke
//! off; steps that odometry measured are held ([`CameraCoupling`]).
//!
//! Three types to know: [`MultibodyGraph`] estimates the whole drive in one update, or its last seconds with every frame;
//! [`GraphOptions`] are its settings; [`WindowFrames`] are the frames of a window and their times: motion noise,
//! correlations and weights are functions of time, not of the number of frames.
//!
//! ```
//! use motorcade_geometry::Pose;
//! use motorcade_multibody::{GraphOptions, MultibodyGraph, WindowFrames};
//! use motorcade_odometry::{EgoTrajectory, ExternalTrajectoryOptions, MetricOptions, OdometryTrajectory};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! # fn main() -> Result<(), motorcade_graph::GraphError> {
//! let pose = |k: usize| Pose::from_parts(UnitQuaternion::identity(), Vector3::z() * k as f64);
//! let poses: Vec<_> = (0..10).map(pose).collect();
//! let timestamps_ns: Vec<i64> = (0..10).map(|k| k * 100_000_000).collect();
//! let odometry = OdometryTrajectory::from_poses(&poses, &timestamps_ns, &ExternalTrajectoryOptions::default());
//! let mut ego = EgoTrajectory::metric(&odometry, &[], 1.65, 0.0, &MetricOptions::default());
//! let times_s: Vec<f64> = (0..10).map(|k| f64::from(k) * 0.1).collect();
//! let mut graph = MultibodyGraph::drive(&GraphOptions::default(), 1)?;
//! let report = graph.update(&WindowFrames { first: 0, times_s: &times_s }, &mut ego, &mut [])?;
//! assert!(report.converged() && graph.nodes().len() == 10);
//! # Ok(())
//! # }
//! ```

mod advanced;
mod classes;
mod edges;
mod estimates;
mod export;
mod graph;
mod kernel;
mod loops;
mod motion_factors;
mod nodes;
mod options;
mod scaled_pose_factor;
mod start;
#[cfg(test)]
mod tests;
mod times;
mod track_scales;
mod variance;

pub use advanced::AdvancedGraphOptions;
pub use classes::EdgeClass;
pub use graph::{MultibodyGraph, MultibodyGraphState, WindowFrames};
pub use kernel::GraphKernel;
pub use loops::{
    AdvancedLoopOptions, LoopEdge, LoopOptions, LoopReport, LoopSolve, MapEdge, PlaceEdges, close_loops,
};
pub use motion_factors::{NoSideSlip, SteadyMotion};
pub use nodes::Node;
pub use options::{CameraCoupling, GraphOptions};
pub use scaled_pose_factor::ScaledPoseFactor;
pub use variance::VarianceFactor;
