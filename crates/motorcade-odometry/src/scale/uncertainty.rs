//! How well the pose of each frame is known: steps, and errors of scale that frames share.

use motorcade_geometry::{Camera, Pose, lie::se3::adjoint};
use nalgebra::{Matrix6, Vector6};

use super::ego_trajectory::EgoFrame;

/// Derivative of a step by the logarithm of its scale (6).
fn along(step: &Pose<Camera, Camera>) -> Vector6<f64> {
    let t = step.rotation_matrix().transpose() * step.translation();
    Vector6::new(0.0, 0.0, 0.0, t.x, t.y, t.z)
}

/// What is known of pose and scale together. Errors of scale last for seconds: taken as independent from step to step they
/// would average out, and the pose would seem several times better known than it is.
#[derive(Clone, Debug, Default)]
pub struct Uncertainty {
    /// Covariance of the pose (6×6).
    pose: Matrix6<f64>,
    /// Covariance of pose and log scale (6).
    shared: Vector6<f64>,
    /// Derivative of the pose by the logarithm of the scale of all frames at once (6).
    by_whole_scale: Vector6<f64>,
    /// Standard deviations of log scale of the frame before, and of what all frames share.
    scale_sigma: f64,
    bias_sigma: f64,
    begun: bool,
}

impl Uncertainty {
    /// Covariance of the pose of the last frame in the world (6×6 `[ω, ν]`).
    pub fn covariance(&self) -> Matrix6<f64> {
        let shared = self.by_whole_scale * self.bias_sigma;
        self.pose + shared * shared.transpose()
    }

    /// Takes one frame and the step that led to it (`camera_before_from_camera`, metres); returns the covariance of its
    /// pose in the world.
    pub fn advance(&mut self, frame: &EgoFrame, step: &Pose<Camera, Camera>) -> Matrix6<f64> {
        if !self.begun {
            (self.begun, self.scale_sigma) = (true, frame.scale_sigma);
            return self.covariance();
        }
        let across = adjoint(&step.isometry().inverse());
        let by_scale = along(step);
        let sigma = frame.scale_sigma;
        // e_k = a e_k−1 + noise, with a from the correlation; where nothing links them the error is a new one.
        let a = if self.scale_sigma > 0.0 { frame.scale_correlation * sigma / self.scale_sigma } else { 0.0 };
        let shared = across * self.shared * a;
        let rest = sigma * sigma - frame.scale_sigma_alone * frame.scale_sigma_alone;
        self.pose = across * self.pose * across.transpose()
            + frame.step_covariance
            + by_scale * by_scale.transpose() * rest
            + shared * by_scale.transpose()
            + by_scale * shared.transpose();
        self.shared = shared + by_scale * (sigma * sigma);
        self.scale_sigma = sigma;
        self.by_whole_scale = across * self.by_whole_scale + by_scale;
        self.bias_sigma = frame.scale_bias_sigma;
        self.covariance()
    }
}

/// Covariance of a step in metres from that of tracking, `scale` metres a unit.
pub(crate) fn step_covariance(
    step: &Pose<Camera, Camera>,
    tracking: Matrix6<f64>,
    scale: f64,
    scale_sigma: f64,
    measured: bool,
) -> Matrix6<f64> {
    let mut out = tracking;
    for k in 3..6 {
        for j in 0..6 {
            out[(k, j)] *= scale;
            out[(j, k)] *= scale;
        }
    }
    out += along(step) * along(step).transpose() * (scale_sigma * scale_sigma);
    if !measured {
        // A tenth of a second unseen: half a degree, and 1 m/s of change in speed.
        for k in 0..3 {
            out[(k, k)] += 0.5_f64.to_radians().powi(2);
            out[(3 + k, 3 + k)] += 0.1_f64.powi(2);
        }
    }
    // A standing camera is known to stand, but not absolutely.
    for k in 0..6 {
        out[(k, k)] += 1e-10;
    }
    out
}
