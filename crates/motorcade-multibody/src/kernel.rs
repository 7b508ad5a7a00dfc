//! Robust kernels of camera–vehicle edges.

use motorcade_geometry::robust::RobustKernel;
use serde::{Deserialize, Serialize};

/// Robust kernels of camera–vehicle edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GraphKernel {
    /// Least squares.
    None,
    /// Huber.
    Huber,
    /// Cauchy.
    #[default]
    Cauchy,
    /// Geman–McClure.
    GemanMcClure,
    /// Dynamic covariance scaling.
    Dcs,
}

impl GraphKernel {
    /// The kernel with a scale of c standard deviations.
    pub fn at_scale(self, c: f64) -> RobustKernel {
        match self {
            Self::None => RobustKernel::None,
            Self::Huber => RobustKernel::Huber(c),
            Self::Cauchy => RobustKernel::Cauchy(c),
            Self::GemanMcClure => RobustKernel::GemanMcClure(c),
            Self::Dcs => RobustKernel::Dcs(c * c),
        }
    }
}
