//! The scales shared by all measurements of a vehicle: their errors are the same in every frame.

use motorcade_graph::factors::VectorPrior;
use motorcade_graph::{Graph, GraphError, VariableId};
use motorcade_vehicles::{PoseObservation, Scaling, VehicleTrajectory};
use nalgebra::{DMatrix, DVector};

use crate::options::GraphOptions;

/// Weight of the prior of the error that the measurements of a vehicle share: it stays at zero, and covariances alone have it. Estimating it too, as far as
/// near frames and far ones differ, made depths of KITTI 0005 worse (1.0 -> 1.2 % in the median).
const HELD: f64 = 1e4;

/// A node whose prior counts `weight` times: the variance that the graph finds for it is that many times too small, and so is the part of a pose's covariance
/// that goes with it.
pub(crate) struct WeightedNode {
    pub(crate) id: VariableId,
    pub(crate) weight: f64,
}

/// Nodes of the scales of a vehicle, logarithms.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct TrackScales {
    /// Size: the logarithm of its height \[m\], its proportions kept.
    pub(crate) size: VariableId,
    /// Error that all boxes and keypoints share, in its standard deviations.
    common: Option<VariableId>,
    /// Log factor on the distances of an external source, and its standard deviation.
    source: Option<(VariableId, f64)>,
}

impl TrackScales {
    /// Adds the scales to a graph, at their current values.
    pub(crate) fn add(graph: &mut Graph, vehicle: &VehicleTrajectory) -> Self {
        Self { size: graph.add_variable(vehicle.size.height_m.ln()), common: None, source: None }
    }

    /// Adds the error that measurements share and the scale of an external source, each at its first measurement.
    pub(crate) fn complete(&mut self, graph: &mut Graph, vehicle: &VehicleTrajectory) {
        let own = |observation: &PoseObservation| match observation.scaling {
            Scaling::Source { sigma } => Some(sigma),
            Scaling::Size => None,
        };
        let sigma = vehicle.states.iter().flat_map(|s| &s.observations).find_map(own);
        let mut observations = vehicle.states.iter().flat_map(|s| &s.observations);
        let any = observations.any(has_common_error);
        self.common = self.common.or_else(|| any.then(|| graph.add_variable(0.0)));
        self.source = self.source.or_else(|| sigma.map(|sigma| (graph.add_variable(0.0), sigma)));
    }

    /// All nodes.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = VariableId> {
        std::iter::once(self.size).chain(self.common).chain(self.source.map(|(id, _)| id))
    }

    /// All nodes with the weights of their priors, that of scales being [`scale_weight`].
    pub(crate) fn weighted(&self, weight: f64) -> impl Iterator<Item = WeightedNode> {
        let common = self.common.map(|id| WeightedNode { id, weight: HELD });
        let scales = std::iter::once(self.size).chain(self.source.map(|(id, _)| id));
        scales.map(move |id| WeightedNode { id, weight }).chain(common)
    }

    /// The error that a measurement shares with all others.
    pub(crate) fn common(&self, observation: &PoseObservation) -> Option<VariableId> {
        self.common.filter(|_| has_common_error(observation))
    }

    /// The scale that a measurement depends on, and the value at which it was made.
    pub(crate) fn of(&self, observation: &PoseObservation, vehicle: &VehicleTrajectory) -> (VariableId, f64) {
        match (observation.scaling, self.source) {
            (Scaling::Source { .. }, Some((id, _))) => (id, 0.0),
            _ => (self.size, vehicle.size.height_m.ln()),
        }
    }

    /// Priors from the vehicle's class, from single frames and of the external source, at the weight of [`scale_weight`].
    pub(crate) fn priors(
        &self,
        vehicle: &VehicleTrajectory,
        weight: f64,
        options: &GraphOptions,
    ) -> Result<Vec<VectorPrior>, GraphError> {
        let least_sigma = options.advanced.least_scale_sigma;
        let prior = |id: VariableId, mean: f64, variance: f64| {
            let information = weight / variance.max(least_sigma * least_sigma);
            VectorPrior::new(id, DVector::from_element(1, mean), DMatrix::from_element(1, 1, information))
        };
        let size = prior(self.size, vehicle.size.height_m.ln(), vehicle.scale_variance());
        let source = self.source.map(|(id, sigma)| prior(id, 0.0, sigma * sigma));
        let common = self.common.map(|id| prior(id, 0.0, weight / HELD));
        std::iter::once(size).chain(common).chain(source).collect()
    }
}

fn has_common_error(observation: &PoseObservation) -> bool {
    observation.common_derivative.iter().any(|d| *d != 0.0)
}

/// Weight of the prior of a scale relative to camera–vehicle measurements, which count as one in `correlation_time_s`. Errors of
/// depth that look like a scale are correlated for longer (plane, slope, habit of the detector), so measurements count for less
/// against the prior, and the variance found is that many times too small.
pub(crate) fn scale_weight(mean_interval_s: f64, options: &GraphOptions) -> f64 {
    let counted_as_one = options.correlation_time_s.max(mean_interval_s);
    (options.advanced.scale_correlation_time_s / counted_as_one).max(1.0)
}
