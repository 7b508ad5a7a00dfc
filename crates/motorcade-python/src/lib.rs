//! `motorcade._native`: the part of the Python package that is written in Rust.
//!
//! The package in `python/motorcade` gives its functions defaults, types and documentation. Everything that takes long runs on
//! a thread of its own ([`supervise`]), without the interpreter's lock, while the calling thread looks for Ctrl-C and calls the
//! progress function.

#[cfg(feature = "python")]
mod arrays;
#[cfg(feature = "python")]
mod camera;
#[cfg(feature = "python")]
mod detector;
#[cfg(feature = "python")]
mod drive;
#[cfg(feature = "python")]
mod errors;
#[cfg(feature = "python")]
mod estimate;
#[cfg(feature = "python")]
mod evaluate;
#[cfg(feature = "python")]
mod graph;
#[cfg(feature = "python")]
mod marginals;
#[cfg(feature = "python")]
mod named_graph;
#[cfg(feature = "python")]
mod picture;
#[cfg(feature = "python")]
mod recorded;
#[cfg(feature = "python")]
mod run;
#[cfg(feature = "python")]
mod running;
#[cfg(feature = "python")]
mod settings;
#[cfg(feature = "python")]
mod simulate;
#[cfg(feature = "python")]
mod slam;
#[cfg(feature = "python")]
mod solve;
#[cfg(feature = "python")]
mod supervise;
#[cfg(feature = "python")]
mod tables;

/// The part of the package `motorcade` that is written in Rust; import `motorcade` instead.
#[cfg(feature = "python")]
#[pyo3::pymodule(name = "_native")]
mod native {
    #[pymodule_export]
    use crate::camera::read_calibration;
    #[pymodule_export]
    use crate::drive::NativeDrive;
    #[pymodule_export]
    use crate::errors::{Error, GraphError, InputError, ResourceError, SettingsError};
    #[pymodule_export]
    use crate::evaluate::evaluate;
    #[pymodule_export]
    use crate::graph::PoseGraph;
    #[pymodule_export]
    use crate::marginals::Marginals;
    #[pymodule_export]
    use crate::recorded::read_run;
    #[pymodule_export]
    use crate::run::run;
    #[pymodule_export]
    use crate::settings::settings_text;
    #[pymodule_export]
    use crate::simulate::{scenarios, simulate};
    #[pymodule_export]
    use crate::slam::NativeMotorcade;
    #[pymodule_export]
    use crate::tables::tables;
}
