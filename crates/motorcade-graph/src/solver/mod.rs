//! Nonlinear least squares on a graph.

mod driver;
mod graduate;
mod options;
mod problem;
mod report;
mod step;

pub use driver::{Solver, optimise};
pub use graduate::{GraduateOptions, graduate};
pub use options::{Control, Method, Options, Progress};
pub(crate) use problem::Problem;
pub use report::{Iteration, Report, Termination, Timings};
