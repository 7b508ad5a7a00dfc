//! Covariances of chosen variables.

use motorcade_sparse::{Cholesky, SelectedInverse, Stop};
use nalgebra::{DMatrix, DMatrixView};

use crate::GraphError;
use crate::graph::Graph;
use crate::ids::VariableId;
use crate::manifold::Manifold;
use crate::solver::Problem;

/// Posterior covariances `H⁻¹` at the current values, in each variable's tangent (right perturbation).
///
/// Made once by factorising H with the final robust weights and no damping. [`new`](Self::new) answers for any variables: blocks of those that
/// share a front of the factorisation, all pairs joined by a factor among them, cost nothing more. [`of_sets`](Self::of_sets) answers for the
/// sets that it was made for, in about half the memory.
#[derive(Debug)]
pub struct Marginals {
    /// Free variables and their tangent sizes, by increasing id: in the order of the blocks of H.
    free: Vec<(VariableId, usize)>,
    /// Fixed variables and their tangent sizes: their covariance is zero.
    fixed: Vec<(VariableId, usize)>,
    kept: Kept,
}

/// Blocks of `H⁻¹` that are kept.
#[derive(Debug)]
enum Kept {
    /// All blocks on the pattern of the factor, and what others follow from.
    Pattern(Box<(Problem, Cholesky, SelectedInverse)>),
    Chosen(ChosenBlocks),
}

/// Blocks of chosen pairs of variables, one after the other, column-major.
#[derive(Debug)]
struct ChosenBlocks {
    /// Later and earlier variable of each, increasing.
    pairs: Vec<(VariableId, VariableId)>,
    starts: Vec<usize>,
    values: Vec<f64>,
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
        let (problem, factor) = factorised(graph, &[], stop)?;
        let inverse = SelectedInverse::new(&problem.matrix, &factor, stop).ok_or(GraphError::Stopped)?;
        let [free, fixed] = [sizes(graph, &problem.variables)?, sizes(graph, graph.fixed())?];
        Ok(Self { free, fixed, kept: Kept::Pattern(Box::new((problem, factor, inverse))) })
    }

    /// For joint covariances of the variables of each of `sets` alone, given up when asked to. The variables of a set need not be joined by
    /// factors, but should be near each other.
    ///
    /// # Errors
    /// As [`new_unless`](Self::new_unless); variables that are not in the graph.
    pub fn of_sets<S: AsRef<[VariableId]>>(
        graph: &Graph,
        sets: impl IntoIterator<Item = S>,
        stop: Stop<'_>,
    ) -> Result<Self, GraphError> {
        let mut pairs: Vec<(VariableId, VariableId)> = Vec::new();
        for set in sets {
            let free: Vec<VariableId> =
                set.as_ref().iter().copied().filter(|id| !graph.is_fixed(*id)).collect();
            for (k, &a) in free.iter().enumerate() {
                pairs.extend(free[..=k].iter().map(|&b| (a.max(b), a.min(b))));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let (problem, factor) = factorised(graph, &pairs, stop)?;
        let [free, fixed] = [sizes(graph, &problem.variables)?, sizes(graph, graph.fixed())?];
        let at = |id: VariableId| block(&free, id).ok_or(GraphError::UnknownVariable(id));
        let (mut blocks, mut starts) = (Vec::with_capacity(pairs.len()), vec![0]);
        for (a, b) in &pairs {
            let (a, b) = (at(*a)?, at(*b)?);
            blocks.push((a as u32, b as u32));
            starts.push(starts[starts.len() - 1] + free[a].1 * free[b].1);
        }
        let mut values = vec![0.0; starts[pairs.len()]];
        let keep = |k: usize, block: DMatrixView<'_, f64>| {
            values[starts[k]..starts[k + 1]].iter_mut().zip(block.iter()).for_each(|(x, y)| *x = *y);
        };
        SelectedInverse::visit(&problem.matrix, &factor, &blocks, stop, keep).ok_or(GraphError::Stopped)?;
        Ok(Self { free, fixed, kept: Kept::Chosen(ChosenBlocks { pairs, starts, values }) })
    }

    /// Logarithm of the determinant of the information matrix H of the free variables: with the cost it tells how probable the measurements are
    /// with their covariances, whatever the variables.
    ///
    /// # Errors
    /// As [`new_unless`](Self::new_unless).
    pub fn log_determinant(graph: &Graph, stop: Stop<'_>) -> Result<f64, GraphError> {
        let (problem, factor) = factorised(graph, &[], stop)?;
        Ok(factor.log_determinant(&problem.matrix))
    }

    /// Covariance of one variable (dof × dof).
    pub fn covariance(&self, variable: VariableId) -> Result<DMatrix<f64>, GraphError> {
        self.cross(variable, variable)
    }

    /// Covariance between two variables (dof of `a` × dof of `b`). With [`new`](Self::new) pairs outside the pattern of the factor cost a
    /// forward substitution along their paths to the first front above both.
    ///
    /// # Errors
    /// Variables that the graph does not have, or that no set holds together.
    pub fn cross(&self, a: VariableId, b: VariableId) -> Result<DMatrix<f64>, GraphError> {
        let (Some(i), Some(j)) = (block(&self.free, a), block(&self.free, b)) else {
            return Ok(DMatrix::zeros(self.dof(a)?, self.dof(b)?));
        };
        match &self.kept {
            Kept::Pattern(all) => {
                let (problem, factor, inverse) = &**all;
                Ok(inverse.block(&problem.matrix, factor, i as u32, j as u32))
            }
            Kept::Chosen(chosen) => {
                let later = chosen.block(a.max(b), a.min(b), self.free[i.max(j)].1);
                let later = later.ok_or(GraphError::NotAskedFor(a, b))?;
                Ok(if a < b { later.transpose() } else { later })
            }
        }
    }

    /// Joint covariance of several variables, in the order given.
    ///
    /// # Errors
    /// As [`cross`](Self::cross).
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

    fn dof(&self, variable: VariableId) -> Result<usize, GraphError> {
        let size = |of: &[(VariableId, usize)]| block(of, variable).map(|k| of[k].1);
        size(&self.free).or_else(|| size(&self.fixed)).ok_or(GraphError::UnknownVariable(variable))
    }
}

impl ChosenBlocks {
    /// The block of a pair, `rows` the tangent size of the later one; `None` where it was not chosen.
    fn block(&self, later: VariableId, earlier: VariableId, rows: usize) -> Option<DMatrix<f64>> {
        let at = self.pairs.binary_search(&(later, earlier)).ok()?;
        let values = &self.values[self.starts[at]..self.starts[at + 1]];
        Some(DMatrix::from_column_slice(rows, values.len() / rows, values))
    }
}

/// Place of a variable in a list by increasing id.
fn block(of: &[(VariableId, usize)], variable: VariableId) -> Option<usize> {
    of.binary_search_by_key(&variable, |v| v.0).ok()
}

/// Variables and their tangent sizes.
fn sizes(graph: &Graph, variables: &[VariableId]) -> Result<Vec<(VariableId, usize)>, GraphError> {
    variables.iter().map(|&id| Ok((id, graph.values().value(id)?.dof()))).collect()
}

/// The normal equations at the current values and their factor, without damping, `pairs` in the pattern.
fn factorised(
    graph: &Graph,
    pairs: &[(VariableId, VariableId)],
    stop: Stop<'_>,
) -> Result<(Problem, Cholesky), GraphError> {
    let mut problem = Problem::for_covariances(graph, pairs)?;
    if !problem.linearise(graph, graph.values(), false)?.is_finite() {
        return Err(GraphError::NotFinite);
    }
    let mut factor = Cholesky::default();
    factor.factorise(&problem.matrix, 0.0, false, None, stop).map_err(GraphError::unfactorised)?;
    factor.shrink();
    Ok((problem, factor))
}
