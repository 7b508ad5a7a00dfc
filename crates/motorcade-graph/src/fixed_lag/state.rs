//! State of a window, to be kept in a file.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::FixedLag;
use crate::GraphError;
use crate::factor::Factor;
use crate::graph::{Graph, GraphState};
use crate::ids::{FactorId, VariableId};

/// State of a [`FixedLag`] whose factors are kept as `F`, without its options.
#[derive(Serialize, Deserialize)]
pub struct FixedLagState<F> {
    graph: GraphState<F>,
    frames: VecDeque<Vec<VariableId>>,
    priors: Vec<FactorId>,
}

impl FixedLag {
    /// The state, each factor kept by `kept`; `None` where that returns `None`, for a type of factor that it does not know.
    pub fn state<F>(&self, kept: impl Fn(&dyn Factor) -> Option<F>) -> Option<FixedLagState<F>> {
        // The solver keeps memory alone from solve to solve.
        let Self { graph, solver: _, lag: _, frames, priors, solved: _ } = self;
        Some(FixedLagState { graph: graph.state(kept)?, frames: frames.clone(), priors: priors.clone() })
    }

    /// A window with the options of this one, as in a state: it goes on with the same bits.
    ///
    /// # Errors
    /// A state that does not fit together.
    pub fn resumed<F>(
        self,
        state: FixedLagState<F>,
        factor: impl Fn(F) -> Box<dyn Factor>,
    ) -> Result<Self, GraphError> {
        let FixedLagState { graph, frames, priors } = state;
        let graph = Graph::from_state(graph, factor)?;
        if let Some(unknown) = priors.iter().find(|id| graph.factor(**id).is_none()) {
            return Err(GraphError::UnknownFactor(*unknown));
        }
        Ok(Self { graph, frames, priors, solved: false, ..self })
    }
}
