//! Odometry edges of the graph of loops: free, with the uncertainty that their sum has.

use motorcade_geometry::{Camera, Pose};
use motorcade_odometry::EgoFrame;
use nalgebra::Matrix6;

use super::options::LoopOptions;
use crate::edges::{inverse, motion_of};
use crate::options::GraphOptions;

/// Information (6×6) of the step to a frame. In the multi-object graph measured steps are held against vehicles; places are seen better
/// than a trajectory drifts, so that here they give way, each by its share of what the whole way may be off.
pub(super) fn information(
    frame: &EgoFrame,
    step: &Pose<Camera, Camera>,
    options: &LoopOptions,
    graph: &GraphOptions,
    interval_s: f64,
) -> Matrix6<f64> {
    if !frame.step_measured {
        return inverse(&(frame.step_covariance * options.advanced.break_inflation));
    }
    let (along, d) = motion_of(step);
    // Errors of consecutive poses are anti-correlated, but for those of scale.
    let across = Matrix6::identity() - d * d.transpose();
    let shrink =
        Matrix6::identity() - across * (1.0 - (1.0 + graph.advanced.step_anticorrelation).sqrt().recip());
    let alone = shrink * frame.step_covariance * shrink.transpose();
    // A first-order process of correlation ρ adds up as independent steps of (1 + ρ) / (1 − ρ) times its variance.
    let correlation = frame.scale_correlation.clamp(0.0, 0.999_9);
    let most = (options.advanced.most_correlated_s / interval_s).max(1.0);
    let together = ((1.0 + correlation) / (1.0 - correlation)).min(most);
    let own = frame.scale_sigma_alone.powi(2);
    let more = (frame.scale_sigma.powi(2) * together - own).max(0.0) * along.norm_squared();
    inverse(&(alone + d * d.transpose() * more))
}
