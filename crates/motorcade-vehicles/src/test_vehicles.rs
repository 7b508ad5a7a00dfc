//! Vehicles for tests.

use std::ops::Range;

use motorcade_geometry::{BoundingBox, Pose};
use motorcade_perception::VehicleClass;
use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::size_prior::size_prior;
use crate::trajectory::{Source, VehicleState, VehicleTrajectory};

/// A car that stands along x, one state in each of these frames: measured with a score of 1, without a box.
pub(crate) fn standing_car(id: usize, frames: Range<usize>, at: [f64; 2]) -> VehicleTrajectory {
    let state = |frame| VehicleState {
        frame,
        world_from_vehicle: Pose::exp(&Vector6::new(0.0, 0.0, 0.0, at[0], at[1], 0.0)),
        covariance: Matrix6::identity() * 0.09,
        bbox: None,
        score: 1.0,
        speed_mps: 0.0,
        speed_sigma_mps: 0.1,
        yaw_rate_radps: 0.0,
        source: Source::Box,
        measurement: None,
        observations: Vec::new(),
    };
    VehicleTrajectory {
        id,
        class: VehicleClass::Car,
        size: size_prior(VehicleClass::Car).mean,
        size_covariance: Matrix3::identity() * 0.01,
        size_by_road: None,
        p_moving: 0.1,
        states: frames.map(state).collect(),
    }
}

impl VehicleTrajectory {
    /// With this box in every frame [px].
    pub(crate) fn with_box(mut self, bbox: [f64; 4]) -> Self {
        self.states.iter_mut().for_each(|s| s.bbox = Some(BoundingBox::new(bbox)));
        self
    }

    /// With these scores; states are predicted where it is zero.
    pub(crate) fn with_scores(mut self, score: impl Fn(usize) -> f64) -> Self {
        for state in &mut self.states {
            state.score = score(state.frame);
            state.source = if state.score > 0.0 { Source::Box } else { Source::Predicted };
        }
        self
    }
}
