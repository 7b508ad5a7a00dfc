//! Nonlinear least squares on a graph.

mod dog_leg;
mod driver;
mod gauss_newton;
mod graduate;
mod levenberg_marquardt;
mod limits;
mod options;
mod problem;
mod report;
mod run;
mod step;

pub use driver::{Solver, optimise};
pub use graduate::{GraduateOptions, graduate, graduate_unless};
pub(crate) use limits::Limits;
pub use options::{Control, Method, Options, Progress};
pub(crate) use problem::Problem;
pub use report::{Iteration, Report, Termination, Timings};
