//! Sparse nonlinear least squares on manifolds, made for SE(3) pose graphs.
//!
//! A [`Graph`] holds variables `x_i` on manifolds and factors; [`optimise`] minimises
//!
//! ```text
//! F(x) = Σ_f ρ_f( r_f(x)ᵀ Ω_f r_f(x) )
//! ```
//!
//! with residual r (m), information Ω (m×m, symmetric positive semidefinite) and loss ρ (the identity unless the
//! factor is wrapped by [`Robust`]). There is no factor ½: for Gaussian noise F is χ².
//!
//! # Maths
//!
//! Poses are `world_from_body`; tangents are `[ω, ν]`, rotation first, and act on the right: `X ⊞ δ = X·exp(δ)`. One
//! iteration linearises `r(x ⊞ δ) ≈ r + J δ` (J: m × Σ dof) and solves
//!
//! ```text
//! (H + λI) δ = −g      H = Σ ρ' JᵀΩJ      g = Σ ρ' JᵀΩr
//! ```
//!
//! For two poses and a measured motion Z ([`factors::Between`]):
//!
//! ```text
//! E = Z⁻¹ Xi⁻¹ Xj       r = log(E)                      (6)
//! ∂r/∂δ_j = Jr⁻¹(r)                                     (6×6)
//! ∂r/∂δ_i = −Jr⁻¹(r) · Ad(Xj⁻¹ Xi)                      (6×6)
//! ```
//!
//! H has a fixed block pattern, which `motorcade-sparse` orders and analyses once and factorises at every iteration.
//! Fixed variables have no columns in H. Results are the same, bit for bit, for any number of threads; they may
//! differ in the last bits between processors with and without fused multiply-add.
//!
//! # The types to know
//!
//! [`Graph`], the [`Factor`] trait, [`Options`] with [`Report`]. Beyond them: [`Marginals`] for covariances,
//! [`FixedLag`] for online use, [`start`] for graphs without good starting values, [`g2o`] for files, [`numeric`] to
//! check the Jacobians of one's own factors.
//!
//! ```
//! use motorcade_graph::factors::Between;
//! use motorcade_graph::{Graph, Marginals, Options, Robust, RobustKernel, optimise};
//! use nalgebra::{Isometry3, Matrix6, Vector3};
//!
//! # fn main() -> Result<(), motorcade_graph::GraphError> {
//! // Drive a square: four steps of 1 m with a quarter turn each end where they began.
//! let step = Isometry3::new(Vector3::x(), Vector3::z() * std::f64::consts::FRAC_PI_2);
//! let mut graph = Graph::new();
//! let mut corners = vec![graph.add_variable(Isometry3::identity())];
//! for k in 1..4 {
//!     let guess = Isometry3::translation(k as f64 * 0.3, 0.5, 0.1);
//!     corners.push(graph.add_variable(guess));
//! }
//! graph.fix(corners[0])?;
//! for k in 0..4 {
//!     let edge = Between::new(corners[k], corners[(k + 1) % 4], step, Matrix6::identity() * 100.0)?;
//!     graph.add_factor(Robust::new(edge, RobustKernel::Cauchy(3.55)))?;
//! }
//!
//! let report = optimise(&mut graph, &Options::default())?;
//! assert!(report.converged() && report.final_cost < 1e-9);
//! let opposite = graph.values().get::<Isometry3<f64>>(corners[2])?;
//! assert!((opposite.translation.vector - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-6);
//! let covariance = Marginals::new(&graph)?.covariance(corners[2])?;
//! assert_eq!(covariance.shape(), (6, 6));
//! # Ok(())
//! # }
//! ```

mod error;
mod factor;
pub mod factors;
mod fixed_lag;
pub mod g2o;
pub mod generate;
mod graph;
mod group;
mod ids;
pub mod information;
mod manifold;
mod marginalise;
mod marginals;
pub mod numeric;
mod robust;
pub mod solver;
pub mod start;
mod values;

pub use error::GraphError;
pub use factor::{Factor, MeasuredPose, Normal, RelativePose, Terms};
pub use fixed_lag::{FixedLag, FixedLagState};
pub use graph::Graph;
pub use group::{GroupId, LossScale};
pub use ids::{FactorId, VariableId};
pub use manifold::{Manifold, Value, Variable};
pub use marginalise::marginalise;
pub use marginals::Marginals;
pub use motorcade_geometry::robust::{Loss, RobustKernel};
pub use motorcade_sparse::Stop;
pub use robust::{Kernel, Robust};
pub use solver::{Options, Report, Solver, optimise};
pub use values::Values;
