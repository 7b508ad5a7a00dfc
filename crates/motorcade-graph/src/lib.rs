//! Sparse nonlinear least squares on manifolds.

pub mod command;
mod dense;
mod error;
mod factor;
pub mod factors;
mod fixed_lag;
pub mod g2o;
pub mod generate;
mod graph;
pub mod information;
mod manifold;
mod marginalise;
mod marginals;
pub mod numeric;
mod robust;
pub mod solver;
mod sparse;
pub mod start;
mod values;

pub use error::GraphError;
pub use factor::{Factor, Loss, Normal, RelativePose};
pub use fixed_lag::FixedLag;
pub use graph::{FactorId, Graph};
pub use manifold::{Manifold, Value, Variable};
pub use marginalise::marginalise;
pub use marginals::Marginals;
pub use robust::{Cauchy, Dcs, GemanMcClure, Gnc, Huber, Kernel, Robust};
pub use solver::{Options, Report, Solver, optimise};
pub use values::{Values, VariableId};
