//! Covariances of chosen variables.

use motorcade_sparse::{Cholesky, Ordering, SelectedInverse, Stop};
use nalgebra::DMatrix;

use crate::GraphError;
use crate::graph::Graph;
use crate::ids::VariableId;
use crate::manifold::Manifold;
use crate::solver::Problem;

/// Posterior covariances `H⁻¹` at the current values, in each variable's tangent (right perturbation).
///
/// Made once by factorising H with the final robust weights and no damping; the blocks of variables that share a
/// front of the factorisation, all pairs joined by a factor among them, then cost nothing more.
#[derive(Debug)]
pub struct Marginals {
    problem: Problem,
    factor: Cholesky,
    inverse: SelectedInverse,
    /// Block of each free variable, by variable.
    blocks: Vec<(VariableId, u32)>,
    /// Tangent sizes of fixed variables: their covariance is zero.
    fixed: Vec<(VariableId, usize)>,
}

impl Marginals {
    /// Factorises `graph` at its current values, best after a converged solve.
    pub fn new(graph: &Graph) -> Result<Self, GraphError> {
        Self::new_unless(graph, Stop::NEVER)
    }

    /// As [`new`](Self::new), given up when asked to.
    ///
    /// # Errors
    /// As [`new`](Self::new); [`GraphError::Stopped`].
    pub fn new_unless(graph: &Graph, stop: Stop<'_>) -> Result<Self, GraphError> {
        let (problem, factor) = factorised(graph, stop)?;
        let inverse = SelectedInverse::new(&problem.matrix, &factor, stop).ok_or(GraphError::Stopped)?;
        // Built in the order of ids, hence sorted.
        let blocks = problem.variables.iter().enumerate().map(|(b, &id)| (id, b as u32)).collect();
        let dof = |id: VariableId| Ok((id, graph.values().value(id)?.dof()));
        let fixed = graph.fixed().iter().map(|&id| dof(id)).collect::<Result<_, GraphError>>()?;
        Ok(Self { problem, factor, inverse, blocks, fixed })
    }

    /// Covariance of each free variable alone (dof × dof), by increasing id: the same numbers in about half the memory, as none between variables
    /// are kept.
    ///
    /// # Errors
    /// As [`new_unless`](Self::new_unless).
    pub fn each(graph: &Graph, stop: Stop<'_>) -> Result<Vec<(VariableId, DMatrix<f64>)>, GraphError> {
        let (problem, factor) = factorised(graph, stop)?;
        let blocks = SelectedInverse::diagonal(&problem.matrix, &factor, stop);
        let blocks = blocks.ok_or(GraphError::Stopped)?;
        Ok(problem.variables.into_iter().zip(blocks).collect())
    }

    /// Logarithm of the determinant of the information matrix H of the free variables: with the cost it tells how probable the measurements are
    /// with their covariances, whatever the variables.
    ///
    /// # Errors
    /// As [`new_unless`](Self::new_unless).
    pub fn log_determinant(graph: &Graph, stop: Stop<'_>) -> Result<f64, GraphError> {
        let (problem, factor) = factorised(graph, stop)?;
        Ok(factor.log_determinant(&problem.matrix))
    }

    /// Covariance of one variable (dof × dof).
    pub fn covariance(&self, variable: VariableId) -> Result<DMatrix<f64>, GraphError> {
        self.cross(variable, variable)
    }

    /// Covariance between two variables (dof of `a` × dof of `b`). Pairs outside the pattern of the factor cost a
    /// forward substitution along their paths to the first front above both.
    pub fn cross(&self, a: VariableId, b: VariableId) -> Result<DMatrix<f64>, GraphError> {
        let (Some(i), Some(j)) = (self.block(a), self.block(b)) else {
            return Ok(DMatrix::zeros(self.dof(a)?, self.dof(b)?));
        };
        Ok(self.inverse.block(&self.problem.matrix, &self.factor, i, j))
    }

    /// Joint covariance of several variables, in the order given.
    pub fn joint(&self, variables: &[VariableId]) -> Result<DMatrix<f64>, GraphError> {
        let mut starts = vec![0];
        for &id in variables {
            starts.push(starts[starts.len() - 1] + self.dof(id)?);
        }
        let n = starts[variables.len()];
        let mut out = DMatrix::zeros(n, n);
        for (k, &a) in variables.iter().enumerate() {
            for (l, &b) in variables[..=k].iter().enumerate() {
                let block = self.cross(a, b)?;
                out.view_mut((starts[k], starts[l]), block.shape()).copy_from(&block);
                out.view_mut((starts[l], starts[k]), (block.ncols(), block.nrows()))
                    .copy_from(&block.transpose());
            }
        }
        Ok(out)
    }

    fn block(&self, variable: VariableId) -> Option<u32> {
        let at = self.blocks.binary_search_by_key(&variable, |b| b.0).ok()?;
        Some(self.blocks[at].1)
    }

    fn dof(&self, variable: VariableId) -> Result<usize, GraphError> {
        if let Some(block) = self.block(variable) {
            return Ok(self.problem.matrix.range(block).len());
        }
        let at = self.fixed.binary_search_by_key(&variable, |f| f.0);
        at.map(|k| self.fixed[k].1).map_err(|_| GraphError::UnknownVariable(variable))
    }
}

/// The normal equations at the current values and their factor, without damping.
fn factorised(graph: &Graph, stop: Stop<'_>) -> Result<(Problem, Cholesky), GraphError> {
    let mut problem = Problem::ordered(graph, None, Ordering::ShortPaths)?;
    if !problem.linearise(graph, graph.values(), false)?.is_finite() {
        return Err(GraphError::NotFinite);
    }
    let mut factor = Cholesky::default();
    factor.factorise(&problem.matrix, 0.0, false, None, stop).map_err(GraphError::unfactorised)?;
    factor.shrink();
    Ok((problem, factor))
}
