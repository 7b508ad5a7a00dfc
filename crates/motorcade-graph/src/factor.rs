//! Factors, and their shares of the normal equations.

use std::any::Any;
use std::fmt;

use motorcade_geometry::robust::Loss;
use nalgebra::{
    DMatrixView, DMatrixViewMut, DVectorView, DVectorViewMut, Dim, IsContiguous, Matrix, RawStorage,
};

use crate::GraphError;
use crate::ids::VariableId;
use crate::values::Values;

/// Variables and information of a factor.
#[derive(Clone, Copy, Debug)]
pub struct Terms<'a> {
    /// The variables the residual depends on, without repetition.
    pub variables: &'a [VariableId],
    /// Ω, m×m for a residual of length m, symmetric positive semidefinite.
    pub information: DMatrixView<'a, f64>,
}

impl<'a> Terms<'a> {
    /// Of a matrix of fixed or of dynamic size.
    pub fn new<R: Dim, C: Dim, S>(variables: &'a [VariableId], information: &'a Matrix<f64, R, C, S>) -> Self
    where
        S: RawStorage<f64, R, C> + IsContiguous,
    {
        let (rows, columns) = information.shape();
        Self { variables, information: DMatrixView::from_slice(information.as_slice(), rows, columns) }
    }
}

/// One term `ρ(rᵀ Ω r)` of the cost. Implement [`terms`](Self::terms) and [`evaluate`](Self::evaluate); the rest
/// follows.
pub trait Factor: Any + fmt::Debug + Send + Sync {
    /// Variables and information.
    fn terms(&self) -> Terms<'_>;

    /// The variables the residual depends on, without repetition.
    fn variables(&self) -> &[VariableId] {
        self.terms().variables
    }

    /// Length m of the residual.
    fn dim(&self) -> usize {
        self.terms().information.nrows()
    }

    /// Ω, m×m, symmetric positive semidefinite.
    fn information(&self) -> DMatrixView<'_, f64> {
        self.terms().information
    }

    /// Writes the residual r (m) and, when asked for, the Jacobian: m × Σ dof, the columns of the variables side by
    /// side in the order of [`variables`](Self::variables), derivatives by the right perturbation of each.
    /// The Jacobian comes in zeroed.
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError>;

    /// The loss at `s = rᵀ Ω r`; plain least squares unless wrapped by [`Robust`](crate::Robust).
    fn loss(&self, s: f64) -> Loss {
        Loss { cost: s, weight: 1.0 }
    }

    /// `rᵀ Ω r`.
    fn squared_norm(&self, values: &Values) -> Result<f64, GraphError> {
        let m = self.dim();
        let mut small = [0.0; 16];
        let mut large = Vec::new();
        let r = if m <= small.len() {
            &mut small[..m]
        } else {
            large.resize(m, 0.0);
            &mut large[..]
        };
        self.evaluate(values, &mut DVectorViewMut::from_slice(r, m), None)?;
        let r = DVectorView::from_slice(r, m);
        let information = self.information();
        Ok((0..m).map(|j| r[j] * information.column(j).dot(&r)).sum())
    }

    /// Writes `H = Jᵀ Ω J` and `g = Jᵀ Ω r` into `out` and returns `rᵀ Ω r`. Only worth overriding where the
    /// Jacobians have structure to exploit.
    fn normal_equations(&self, values: &Values, out: &mut Normal) -> Result<f64, GraphError> {
        out.fill_from_jacobian(self, values)
    }

    /// The SE(3) measurement behind a factor that compares two poses; lets initialisation and files use it.
    fn relative_pose(&self) -> Option<RelativePose<'_>> {
        None
    }

    /// The measured pose `first_from_second` of the first two variables and its information (6×6, `[ω, ν]`), where it
    /// depends on further variables: at their values.
    fn relative_pose_at(&self, _values: &Values) -> Result<Option<MeasuredPose>, GraphError> {
        Ok(None)
    }

    /// The SE(2) measurement `first_from_second` behind a factor that compares two poses of the plane.
    fn relative_plane(&self) -> Option<&nalgebra::Isometry2<f64>> {
        None
    }
}

/// Measured motion between the two SE(3) variables of a factor.
#[derive(Clone, Copy, Debug)]
pub struct RelativePose<'a> {
    /// `first_from_second`.
    pub measurement: &'a nalgebra::Isometry3<f64>,
    /// Ω in `[ω, ν]` order.
    pub information: &'a nalgebra::Matrix6<f64>,
}

/// The measured motion between the first two SE(3) variables of a factor, at the values of the others.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredPose {
    /// `first_from_second`.
    pub measurement: nalgebra::Isometry3<f64>,
    /// Ω in `[ω, ν]` order.
    pub information: nalgebra::Matrix6<f64>,
}

/// A factor's share of the normal equations, with the buffers to compute it.
#[derive(Clone, Debug, Default)]
pub struct Normal {
    size: usize,
    h: Vec<f64>,
    g: Vec<f64>,
    jacobian: Vec<f64>,
    residual: Vec<f64>,
    weighted: Vec<f64>,
}

impl Normal {
    /// Makes room for `size` = Σ dof of the factor's variables.
    pub fn resize(&mut self, size: usize) {
        if self.size != size {
            self.size = size;
            self.h.resize(size * size, 0.0);
            self.g.resize(size, 0.0);
        }
    }
    /// Σ dof.
    pub fn size(&self) -> usize {
        self.size
    }
    /// H, size×size, column-major. Only the lower block triangle is read.
    pub fn h(&self) -> &[f64] {
        &self.h
    }
    /// H to be overwritten, entry by entry.
    pub fn h_mut(&mut self) -> &mut [f64] {
        &mut self.h
    }
    /// Gradient half g = Jᵀ Ω r.
    pub fn g(&self) -> &[f64] {
        &self.g
    }
    /// g to be overwritten.
    pub fn g_mut(&mut self) -> &mut [f64] {
        &mut self.g
    }

    /// g and H of two poses, to be overwritten.
    pub(crate) fn chunks_mut(&mut self) -> Option<(&mut [f64; 12], &mut [f64; 144])> {
        Some((self.g.first_chunk_mut()?, self.h.first_chunk_mut()?))
    }

    /// g and H of twelve tangent directions.
    pub(crate) fn chunks(&self) -> Option<(&[f64; 12], &[f64; 144])> {
        Some((self.g.first_chunk()?, self.h.first_chunk()?)).filter(|_| self.size == 12)
    }

    fn fill_from_jacobian<F: Factor + ?Sized>(
        &mut self,
        factor: &F,
        values: &Values,
    ) -> Result<f64, GraphError> {
        let (m, n) = (factor.dim(), self.size);
        self.residual.resize(m, 0.0);
        self.jacobian.clear();
        self.jacobian.resize(m * n, 0.0);
        self.weighted.resize(m * n, 0.0);
        factor.evaluate(
            values,
            &mut DVectorViewMut::from_slice(&mut self.residual, m),
            Some(&mut DMatrixViewMut::from_slice(&mut self.jacobian, m, n)),
        )?;
        let information = factor.information();
        let j = DMatrixView::from_slice(&self.jacobian, m, n);
        let r = DVectorView::from_slice(&self.residual, m);
        let mut wj = DMatrixViewMut::from_slice(&mut self.weighted, m, n);
        information.mul_to(&j, &mut wj);
        wj.tr_mul_to(&j, &mut DMatrixViewMut::from_slice(&mut self.h, n, n));
        wj.tr_mul_to(&r, &mut DVectorViewMut::from_slice(&mut self.g, n));
        Ok((0..m).map(|k| r[k] * information.column(k).dot(&r)).sum())
    }
}
