//! Residuals of relative poses.

use crate::GraphError;

/// Residual (6, rotation first) of the error motion `E = Z⁻¹ Xi⁻¹ Xj`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseResidual {
    /// `log(E) = [ω, ν]` (GTSAM).
    #[default]
    Log,
    /// `[q_xyz, t]` of E with q_w ≥ 0 (g2o).
    Mqt,
}

impl std::str::FromStr for PoseResidual {
    type Err = GraphError;
    fn from_str(s: &str) -> Result<Self, GraphError> {
        match s {
            "log" => Ok(Self::Log),
            "mqt" => Ok(Self::Mqt),
            _ => Err(GraphError::Option { name: "cost", reason: format!("{s:?} is none of log, mqt") }),
        }
    }
}
