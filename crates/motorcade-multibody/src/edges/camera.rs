//! Camera–camera edges: odometry.

use motorcade_geometry::{Camera, Pose};
use motorcade_graph::factors::Between;
use motorcade_graph::{GraphError, VariableId};
use motorcade_odometry::EgoFrame;
use nalgebra::{Matrix6, Vector3, Vector6};

use super::edge::{Edge, EdgeContext, inverse, weighted};
use crate::classes::EdgeClass;
use crate::options::{CameraCoupling, GraphOptions};

/// Camera–camera edges of consecutive frames (eqs. 9–14), residual `log(Z⁻¹ C₀⁻¹ C₁)`.
pub(crate) fn of_cameras(context: &EdgeContext<'_>) -> Result<Vec<Edge>, GraphError> {
    let EdgeContext { ego, cameras, options, .. } = context;
    if !options.camera_camera {
        return Ok(Vec::new());
    }
    let edge = |(k, (nodes, frames)): (usize, (&[VariableId], &[EgoFrame]))| {
        let step = frames[0].world_from_camera.inverse() * frames[1].world_from_camera;
        if options.constant_weights {
            let information = weighted(options.lambda_camera); // (15)
            return Ok(Edge::fixed(Between::new(nodes[0], nodes[1], *step.isometry(), information)?));
        }
        let information = step_information(&frames[1], &step, context);
        let edge = Between::new(nodes[0], nodes[1], *step.isometry(), information)?;
        Ok(Edge::classed(edge, EdgeClass::Odometry, k + 1, context))
    };
    cameras.windows(2).zip(ego.frames.windows(2)).enumerate().map(edge).collect()
}

/// True for a step of the camera that no vehicle may change.
pub(crate) fn step_is_held(frame: &EgoFrame, coupling: CameraCoupling, options: &GraphOptions) -> bool {
    match coupling {
        CameraCoupling::Held => true,
        CameraCoupling::StepsHeld => {
            options.camera_camera && frame.step_measured && is_metric(frame, options)
        }
        CameraCoupling::LengthsHeld | CameraCoupling::Free => false,
    }
}

/// True for a scale that was measured, not guessed.
fn is_metric(frame: &EgoFrame, options: &GraphOptions) -> bool {
    frame.scale_sigma < options.advanced.guessed_scale_sigma
}

/// Translation of a step in the frame of its end \[m\], and the unit tangent `[ω, ν]` along it; zero for a step of less than a millimetre.
pub(crate) fn motion_of(step: &Pose<Camera, Camera>) -> (Vector3<f64>, Vector6<f64>) {
    let along = step.rotation_matrix().transpose() * step.translation();
    let d = along.try_normalize(1e-3).unwrap_or_else(Vector3::zeros);
    (along, Vector6::new(0.0, 0.0, 0.0, d.x, d.y, d.z))
}

/// Information (6×6) of a step of the camera.
fn step_information(
    frame: &EgoFrame,
    step: &Pose<Camera, Camera>,
    context: &EdgeContext<'_>,
) -> Matrix6<f64> {
    let (options, advanced) = (context.options, &context.options.advanced);
    let information = inverse(&frame.step_covariance);
    if !frame.step_measured {
        return information;
    }
    let (_, d) = motion_of(step);
    // Errors of consecutive poses are anti-correlated, but for those of scale: the length keeps its variance.
    let anticorrelation = 1.0 + advanced.step_anticorrelation;
    let across = Matrix6::identity() - d * d.transpose();
    let taken = Matrix6::identity() + across * (anticorrelation.sqrt() - 1.0);
    let [turn, place] = [advanced.held_rad, advanced.held_m].map(|sigma| 1.0 / (sigma * sigma));
    let whole = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, place, place, place));
    let held = match context.coupling {
        CameraCoupling::StepsHeld if is_metric(frame, options) => whole,
        CameraCoupling::StepsHeld => across * whole * across,
        CameraCoupling::LengthsHeld if is_metric(frame, options) => d * d.transpose() * place,
        CameraCoupling::LengthsHeld | CameraCoupling::Held | CameraCoupling::Free => Matrix6::zeros(),
    };
    taken * information * taken + held
}
