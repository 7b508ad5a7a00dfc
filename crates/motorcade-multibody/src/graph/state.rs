//! State of the graph of the last seconds, to be kept in a file.

use std::any::Any;
use std::collections::{BTreeMap, VecDeque};

use motorcade_graph::factors::{Between, LinearPrior, VectorPrior};
use motorcade_graph::{Factor, FixedLagState, GraphError, Robust, VariableId};
use serde::{Deserialize, Serialize};

use super::MultibodyGraph;
use crate::motion_factors::{NoSideSlip, SteadyMotion};
use crate::nodes::VehicleNodes;
use crate::scaled_pose_factor::ScaledPoseFactor;

/// State of a [`MultibodyGraph`] of the last seconds, without its options.
#[derive(Serialize, Deserialize)]
pub struct MultibodyGraphState {
    window: FixedLagState<KeptFactor>,
    first: usize,
    cameras: VecDeque<VariableId>,
    all_fixed: bool,
    vehicles: BTreeMap<usize, VehicleNodes>,
}

impl MultibodyGraph {
    /// The state after an update; `None` of the graph of a whole drive, which ends with it.
    pub fn state(&self) -> Option<MultibodyGraphState> {
        // A field that is new does not compile here until it is kept or known to be no state.
        let Self {
            options: _,
            coupling: _,
            whole_drive,
            window,
            first,
            cameras,
            all_fixed,
            vehicles,
            // The first variables of every graph.
            groups: _,
            // Of an update alone.
            counted: _,
            // Of whole drives alone.
            variance_factors: _,
            places: _,
        } = self;
        Some(MultibodyGraphState {
            window: window.state(KeptFactor::of).filter(|_| !whole_drive)?,
            first: *first,
            cameras: cameras.clone(),
            all_fixed: *all_fixed,
            vehicles: vehicles.clone(),
        })
    }

    /// A graph with the options of this one, as in a state.
    ///
    /// # Errors
    /// A state that does not fit together.
    pub fn resumed(self, state: MultibodyGraphState) -> Result<Self, GraphError> {
        let MultibodyGraphState { window, first, cameras, all_fixed, vehicles } = state;
        let window = self.window.resumed(window, KeptFactor::boxed)?;
        let values = window.graph().values();
        let of_vehicles = vehicles.values().flat_map(VehicleNodes::variables);
        cameras.iter().copied().chain(of_vehicles).try_for_each(|id| values.value(id).map(drop))?;
        Ok(Self { window, first, cameras, all_fixed, vehicles, ..self })
    }
}

/// A factor of the graph of the last seconds.
#[derive(Serialize, Deserialize)]
enum KeptFactor {
    /// Prior of variables that were marginalised.
    Prior(LinearPrior),
    Scale(VectorPrior),
    Pose(Between),
    RobustPose(Robust<Between>),
    ScaledPose(Robust<ScaledPoseFactor>),
    SteadyMotion(Robust<SteadyMotion>),
    NoSideSlip(Robust<NoSideSlip>),
}

impl KeptFactor {
    /// A copy of a factor; `None` of one that this graph does not make.
    fn of(factor: &dyn Factor) -> Option<Self> {
        let any: &dyn Any = factor;
        fn copy<T: Clone + 'static>(any: &dyn Any) -> Option<T> {
            any.downcast_ref::<T>().cloned()
        }
        copy(any)
            .map(Self::Prior)
            .or_else(|| copy(any).map(Self::Scale))
            .or_else(|| copy(any).map(Self::Pose))
            .or_else(|| copy(any).map(Self::RobustPose))
            .or_else(|| copy(any).map(Self::ScaledPose))
            .or_else(|| copy(any).map(Self::SteadyMotion))
            .or_else(|| copy(any).map(Self::NoSideSlip))
    }

    fn boxed(self) -> Box<dyn Factor> {
        match self {
            Self::Prior(factor) => Box::new(factor),
            Self::Scale(factor) => Box::new(factor),
            Self::Pose(factor) => Box::new(factor),
            Self::RobustPose(factor) => Box::new(factor),
            Self::ScaledPose(factor) => Box::new(factor),
            Self::SteadyMotion(factor) => Box::new(factor),
            Self::NoSideSlip(factor) => Box::new(factor),
        }
    }
}
