//! State of a graph, to be kept in a file.

use serde::{Deserialize, Serialize};

use super::{Entry, Graph};
use crate::GraphError;
use crate::factor::Factor;
use crate::group::{GroupId, LossScale};
use crate::ids::{FactorId, VariableId};
use crate::values::Values;

/// State of a graph whose factors are kept as `F`.
#[derive(Serialize, Deserialize)]
pub(crate) struct GraphState<F> {
    values: Values,
    fixed: Vec<VariableId>,
    factors: Vec<(FactorId, GroupId, F)>,
    groups: Vec<LossScale>,
    next_factor: u32,
}

impl Graph {
    /// The state, each factor kept by `kept`; `None` where that knows a factor not.
    pub(crate) fn state<F>(&self, kept: impl Fn(&dyn Factor) -> Option<F>) -> Option<GraphState<F>> {
        // The version only tells changes of one graph apart.
        let Self { values, fixed, factors, groups, next_factor, version: _ } = self;
        let factor = |entry: &Entry| Some((entry.id, entry.group, kept(entry.factor.as_ref())?));
        Some(GraphState {
            values: values.clone(),
            fixed: fixed.clone(),
            factors: factors.iter().map(factor).collect::<Option<_>>()?,
            groups: groups.clone(),
            next_factor: *next_factor,
        })
    }

    /// The graph of a state.
    ///
    /// # Errors
    /// A state that is none of a graph: variables or groups that it does not have, factors out of order.
    pub(crate) fn from_state<F>(
        state: GraphState<F>,
        factor: impl Fn(F) -> Box<dyn Factor>,
    ) -> Result<Self, GraphError> {
        let GraphState { values, fixed, factors, groups, next_factor } = state;
        if !values.fit_together() {
            return Err(GraphError::Values);
        }
        let mut graph = Self { values, groups, next_factor, ..Self::new() };
        fixed.into_iter().try_for_each(|id| graph.fix(id))?;
        for (id, group, kept) in factors {
            let factor = factor(kept);
            let in_order = graph.factors.last().is_none_or(|before| before.id < id) && id.0 < next_factor;
            if !in_order || group.0 as usize > graph.groups.len() {
                return Err(GraphError::UnknownFactor(id));
            }
            graph.check(factor.as_ref())?;
            graph.factors.push(Entry { id, group, factor });
        }
        Ok(graph)
    }
}
