//! A factor under a robust kernel.

use std::fmt;

use motorcade_geometry::robust::{Loss, RobustKernel};
use nalgebra::{DMatrixViewMut, DVectorViewMut};

use crate::GraphError;
use crate::factor::{Factor, MeasuredPose, Normal, RelativePose, Terms};
use crate::values::Values;

/// A loss function of `s = rᵀ Ω r`, used by reweighting with `ρ'(s)` (no second-order term, which makes H indefinite for
/// outliers). [`RobustKernel`] has the usual ones.
pub trait Kernel: fmt::Debug + Send + Sync {
    /// ρ(s) and ρ'(s), with ρ(0) = 0 and ρ'(0) = 1.
    fn loss(&self, s: f64) -> Loss;
}

impl Kernel for RobustKernel {
    #[inline]
    fn loss(&self, s: f64) -> Loss {
        (*self).loss(s)
    }
}

/// A factor under a robust kernel, which changes its loss and nothing else.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Robust<F, K = RobustKernel> {
    /// The factor.
    pub factor: F,
    /// Its loss.
    pub kernel: K,
}

impl<F: Factor, K: Kernel> Robust<F, K> {
    /// Wraps `factor`.
    pub fn new(factor: F, kernel: K) -> Self {
        Self { factor, kernel }
    }
}

impl<F: Factor, K: Kernel + 'static> Factor for Robust<F, K> {
    fn terms(&self) -> Terms<'_> {
        self.factor.terms()
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        self.factor.evaluate(values, residual, jacobian)
    }
    fn loss(&self, s: f64) -> Loss {
        // A kernel over a kernel: the chain rule.
        let inner = self.factor.loss(s);
        let outer = self.kernel.loss(inner.cost);
        Loss { cost: outer.cost, weight: outer.weight * inner.weight }
    }
    fn squared_norm(&self, values: &Values) -> Result<f64, GraphError> {
        self.factor.squared_norm(values)
    }
    fn normal_equations(&self, values: &Values, out: &mut Normal) -> Result<f64, GraphError> {
        self.factor.normal_equations(values, out)
    }
    fn relative_pose(&self) -> Option<RelativePose<'_>> {
        self.factor.relative_pose()
    }
    fn relative_pose_at(&self, values: &Values) -> Result<Option<MeasuredPose>, GraphError> {
        self.factor.relative_pose_at(values)
    }
    fn relative_plane(&self) -> Option<&nalgebra::Isometry2<f64>> {
        self.factor.relative_plane()
    }
}
