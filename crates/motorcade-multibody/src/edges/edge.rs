//! An edge, and the settings shared by all edges.

use motorcade_graph::{Factor, Robust, VariableId};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::VehicleTrajectory;
use nalgebra::Matrix6;

use crate::classes::EdgeClass;
use crate::options::{CameraCoupling, GraphOptions};
use crate::times::FrameTimes;

/// An edge, not yet in a graph.
pub(crate) struct Edge {
    /// Class whose covariances may be scaled; `None` for priors.
    pub(crate) class: Option<EdgeClass>,
    pub(crate) factor: Box<dyn Factor>,
}

impl Edge {
    /// An edge whose covariance is never scaled.
    pub(super) fn fixed(factor: impl Factor + 'static) -> Self {
        Self { class: None, factor: Box::new(factor) }
    }

    /// An edge of frame `frame` under the kernel of its class.
    pub(super) fn classed(
        factor: impl Factor + 'static,
        class: EdgeClass,
        frame: usize,
        context: &EdgeContext<'_>,
    ) -> Self {
        let kernel = class.kernel(context.times.interval(frame), context.options);
        Self { class: Some(class), factor: Box::new(Robust::new(factor, kernel)) }
    }
}

/// Camera trajectory, times and settings that all edges depend on.
#[derive(Clone, Copy)]
pub(crate) struct EdgeContext<'a> {
    pub(crate) ego: &'a EgoTrajectory,
    pub(crate) times: FrameTimes<'a>,
    /// `cameras[k]` is the node of frame k of `ego`.
    pub(crate) cameras: &'a [VariableId],
    pub(crate) options: &'a GraphOptions,
    /// As it applies to this window.
    pub(crate) coupling: CameraCoupling,
    /// Weight of the priors of scales.
    pub(crate) scale_weight: f64,
}

/// True for a vehicle that is one node, seen from many cameras.
pub(crate) fn is_static(vehicle: &VehicleTrajectory, options: &GraphOptions) -> bool {
    vehicle.p_moving < options.advanced.static_below_p_moving && !options.constant_weights
}

/// True when all measurements of a vehicle share one variable for the scale of its size.
pub(crate) fn shares_size(options: &GraphOptions) -> bool {
    options.advanced.shared_size && !options.constant_weights
}

/// Information matrix of the paper's constant weights (eq. 15), Ω̄ = λ Ω with Ω = I.
pub(super) fn weighted(lambda: f64) -> Matrix6<f64> {
    Matrix6::identity() * lambda
}

/// Inverse of a covariance; a singular one is regularised until it has one.
pub(crate) fn inverse(covariance: &Matrix6<f64>) -> Matrix6<f64> {
    let mut regular = (covariance + covariance.transpose()) * 0.5;
    for _ in 0..8 {
        if let Some(factor) = regular.cholesky() {
            let information = factor.inverse();
            return (information + information.transpose()) * 0.5;
        }
        regular += Matrix6::identity() * (1e-9 + 1e-3 * regular.trace().abs());
    }
    Matrix6::identity()
}
