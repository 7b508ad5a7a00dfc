//! The scales that all sightings of a vehicle share: what is wrong with them is wrong in every frame alike.

use motorcade_graph::factors::VectorPrior;
use motorcade_graph::{Graph, GraphError, VariableId};
use motorcade_vehicles::{Scaling, Sighting, VehicleTrajectory};
use nalgebra::{DMatrix, DVector};

use super::GraphOptions;

/// Nodes of the scales of a vehicle, logarithms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrackScales {
    /// Of its size: the logarithm of its height \[m\], its proportions kept.
    pub(crate) size: VariableId,
    /// Of the distances given for it: what they are to be multiplied by, and the standard deviation of that.
    source: Option<(VariableId, f64)>,
}

impl TrackScales {
    /// Adds them to a graph, at their values.
    pub(crate) fn add(graph: &mut Graph, vehicle: &VehicleTrajectory) -> Self {
        let mut scales = Self { size: graph.add_variable(vehicle.size.height_m.ln()), source: None };
        scales.complete(graph, vehicle);
        scales
    }

    /// Adds the scale of given distances when the first of them has come.
    pub(crate) fn complete(&mut self, graph: &mut Graph, vehicle: &VehicleTrajectory) {
        let own = |sighting: &Sighting| match sighting.scaling {
            Scaling::Source { sigma } => Some(sigma),
            Scaling::Size => None,
        };
        let sigma = vehicle.states.iter().flat_map(|s| &s.sightings).find_map(own);
        self.source = self.source.or_else(|| sigma.map(|sigma| (graph.add_variable(0.0), sigma)));
    }

    /// All nodes.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = VariableId> {
        std::iter::once(self.size).chain(self.source.map(|(id, _)| id))
    }

    /// The scale that a sighting depends on, and the value of it that the sighting was made with.
    pub(crate) fn of(&self, sighting: &Sighting, vehicle: &VehicleTrajectory) -> (VariableId, f64) {
        match (sighting.scaling, self.source) {
            (Scaling::Source { .. }, Some((id, _))) => (id, 0.0),
            _ => (self.size, vehicle.size.height_m.ln()),
        }
    }

    /// What is known of them from the vehicle's class, from each frame alone, and of whoever gave distances; at the weight of
    /// [`scale_weight`].
    pub(crate) fn priors(
        &self,
        vehicle: &VehicleTrajectory,
        options: &GraphOptions,
    ) -> Result<Vec<VectorPrior>, GraphError> {
        /// Sizes mean no more: outlines are those of a drawing.
        const LEAST_SIGMA: f64 = 0.005;
        let prior = |id: VariableId, mean: f64, variance: f64| {
            let information = scale_weight(options) / variance.max(LEAST_SIGMA * LEAST_SIGMA);
            VectorPrior::new(id, DVector::from_element(1, mean), DMatrix::from_element(1, 1, information))
        };
        let size = prior(self.size, vehicle.size.height_m.ln(), vehicle.scale_variance());
        let source = self.source.map(|(id, sigma)| prior(id, 0.0, sigma * sigma));
        std::iter::once(size).chain(source).collect()
    }
}

/// How much more the prior of a scale counts than views do in the graph. Views count there as one in `correlated_frames`; of
/// the scale they tell less, because errors of depth that last (plane, slope, the detector's habit: two seconds, 20 frames) look
/// like a scale. What counts is the ratio of both, and the variance found is that many times too small.
pub(crate) fn scale_weight(options: &GraphOptions) -> f64 {
    const LASTING_FRAMES: f64 = 20.0;
    (LASTING_FRAMES / options.correlated_frames).max(1.0)
}
