//! Nodes of the graph and their meaning.

use std::collections::BTreeMap;

use motorcade_graph::{Graph, VariableId};
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::Isometry3;
use serde::Serialize;

use crate::track_scales::TrackScales;

/// Meaning of a node, for the sidecar of `graph.g2o`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Node {
    /// `world_from_camera` of a frame.
    Camera {
        /// Row of the run.
        frame: usize,
    },
    /// `world_from_vehicle` of a vehicle in a frame; a static vehicle has one node, of its first frame.
    Vehicle {
        /// Identity.
        id: usize,
        /// Row of the run.
        frame: usize,
    },
}

/// The nodes of a vehicle.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct VehicleNodes {
    pub(crate) poses: PoseNodes,
    /// Scales shared by its measurements.
    pub(crate) scales: Option<TrackScales>,
}

/// The pose nodes of a vehicle, by row of the run.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) enum PoseNodes {
    /// One node, first seen in a row.
    Static(usize, VariableId),
    /// One node a row.
    Moving(BTreeMap<usize, VariableId>),
}

impl VehicleNodes {
    /// All variables of the vehicle.
    pub(crate) fn variables(&self) -> Vec<VariableId> {
        let scales = self.scales.iter().flat_map(TrackScales::nodes);
        self.poses.by_row().into_iter().map(|(_, id)| id).chain(scales).collect()
    }
}

impl PoseNodes {
    pub(crate) fn is_static(&self) -> bool {
        matches!(self, Self::Static(..))
    }

    /// Rows and nodes.
    pub(crate) fn by_row(&self) -> Vec<(usize, VariableId)> {
        match self {
            Self::Static(row, id) => vec![(*row, *id)],
            Self::Moving(nodes) => nodes.iter().map(|(row, id)| (*row, *id)).collect(),
        }
    }

    /// True when the front end turned the vehicle by more than `most_rad` since its newest node; rows count from `first`.
    pub(crate) fn is_flipped(
        &self,
        graph: &Graph,
        first: usize,
        vehicle: &VehicleTrajectory,
        most_rad: f64,
    ) -> bool {
        let turned = |id: VariableId, row: Option<usize>| {
            let same = |s: &&VehicleState| row.is_none_or(|row| first + s.frame == row);
            let state = vehicle.states.iter().rev().find(same)?;
            let node = graph.values().get::<Isometry3<f64>>(id).ok()?;
            Some(node.rotation.angle_to(&state.world_from_vehicle.rotation()) > most_rad)
        };
        match self {
            Self::Static(_, id) => turned(*id, None),
            Self::Moving(nodes) => nodes.iter().next_back().and_then(|(row, id)| turned(*id, Some(*row))),
        }
        .unwrap_or(false)
    }
}
