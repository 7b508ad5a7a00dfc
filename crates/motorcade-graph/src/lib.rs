//! Sparse nonlinear least squares on manifolds.

mod dense;
mod error;
mod factor;
pub mod factors;
pub mod g2o;
mod graph;
pub mod information;
mod manifold;
mod robust;
pub mod solver;
mod sparse;
mod values;

pub use error::GraphError;
pub use factor::{Factor, Loss, Normal, RelativePose};
pub use graph::{FactorId, Graph};
pub use manifold::{Manifold, Value, Variable};
pub use robust::{Cauchy, Dcs, GemanMcClure, Gnc, Huber, Kernel, Robust};
pub use solver::{Options, Report, Solver, optimise};
pub use values::{Values, VariableId};
