//! Covariance of the metric poses: steps, and errors of scale that frames share.

use motorcade_geometry::{Camera, Pose, lie::se3::adjoint};
use nalgebra::{Matrix6, Vector6};

use super::ego_frame::EgoFrame;
use super::options::MetricOptions;
use super::segment_states::Gap;
use crate::time::seconds;

/// Derivative of a step by the logarithm of its scale (6).
fn along(step: &Pose<Camera, Camera>) -> Vector6<f64> {
    let t = step.rotation_matrix().transpose() * step.translation();
    Vector6::new(0.0, 0.0, 0.0, t.x, t.y, t.z)
}

/// Joint covariance of pose and scale. Errors of scale last for seconds: taken as independent from step to step they would
/// average out, and the covariance of the pose would be several times too small.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Uncertainty {
    /// Covariance of the pose (6×6).
    pose: Matrix6<f64>,
    /// Covariance of pose and log scale (6).
    cross: Vector6<f64>,
    /// Derivative of the pose by the logarithm of the scale of all frames at once (6).
    by_whole_scale: Vector6<f64>,
    /// Standard deviation of log scale of the frame before.
    scale_sigma: f64,
    /// Standard deviation of the error of log scale that all frames share.
    bias_sigma: f64,
    started: bool,
}

impl Uncertainty {
    /// A known covariance of the pose of a frame (6×6 `[ω, ν]`) whose error has nothing to do with that of its scale.
    pub fn of(pose: Matrix6<f64>, frame: &EgoFrame) -> Self {
        Self {
            pose,
            scale_sigma: frame.scale_sigma,
            bias_sigma: frame.scale_bias_sigma,
            started: true,
            ..Self::default()
        }
    }

    /// Covariance of the pose of the last frame in the world (6×6 `[ω, ν]`).
    pub fn covariance(&self) -> Matrix6<f64> {
        let shared = self.by_whole_scale * self.bias_sigma;
        self.pose + shared * shared.transpose()
    }

    /// Advances by one frame and the step to it (`camera_before_from_camera`, metres); returns the covariance of its pose in
    /// the world.
    pub fn advance(&mut self, frame: &EgoFrame, step: &Pose<Camera, Camera>) -> Matrix6<f64> {
        if !self.started {
            (self.started, self.scale_sigma) = (true, frame.scale_sigma);
            return self.covariance();
        }
        let transport = adjoint(&step.isometry().inverse());
        let by_scale = along(step);
        let sigma = frame.scale_sigma;
        // e_k = a e_k−1 + noise, with a from the correlation of consecutive errors of scale.
        let a = if self.scale_sigma > 0.0 { frame.scale_correlation * sigma / self.scale_sigma } else { 0.0 };
        let cross = transport * self.cross * a;
        let rest = sigma * sigma - frame.scale_sigma_alone * frame.scale_sigma_alone;
        self.pose = transport * self.pose * transport.transpose()
            + frame.step_covariance
            + by_scale * by_scale.transpose() * rest
            + cross * by_scale.transpose()
            + by_scale * cross.transpose();
        self.cross = cross + by_scale * (sigma * sigma);
        self.scale_sigma = sigma;
        self.by_whole_scale = transport * self.by_whole_scale + by_scale;
        self.bias_sigma = frame.scale_bias_sigma;
        self.covariance()
    }
}

/// Covariance of a step in metres. `tracking` is its covariance in the odometry's unit, `scale` metres per unit; `unmeasured`
/// is the time without a measured pose \[0.1 s\].
pub(super) fn step_covariance(
    step: &Pose<Camera, Camera>,
    tracking: Matrix6<f64>,
    (scale, scale_sigma): (f64, f64),
    unmeasured: Option<f64>,
    options: &MetricOptions,
) -> Matrix6<f64> {
    let mut out = tracking;
    for k in 3..6 {
        for j in 0..6 {
            out[(k, j)] *= scale;
            out[(j, k)] *= scale;
        }
    }
    out += along(step) * along(step).transpose() * (scale_sigma * scale_sigma);
    if let Some(elapsed) = unmeasured {
        for k in 0..3 {
            out[(k, k)] += options.unmeasured_rotation_sigma_rad.powi(2) * elapsed;
            out[(3 + k, 3 + k)] += options.unmeasured_motion_sigma_m.powi(2) * elapsed;
        }
    }
    // A standstill is not known absolutely.
    for k in 0..6 {
        out[(k, k)] += options.least_step_variance;
    }
    out
}

/// Adds to the covariance of a step between two times \[ns\] what a car may do unseen in a gap: turn, with a variance of heading that grows with the
/// third power of the time (white angular acceleration), and brake or accelerate, by a way that grows with its square. The steps of a closed gap have
/// equal parts: a loop that joins the maps then bends all of the way between them. In one that lasts each step has what the gap so far has
/// grown by, so that poses reported one by one have the uncertainty of all of it.
pub(super) fn add_unseen_motion(
    covariance: &mut Matrix6<f64>,
    gap: &Gap,
    times_ns: [i64; 2],
    options: &MetricOptions,
) {
    let since_s = |at_ns: i64| seconds(at_ns - gap.before_ns);
    let ([from, to], whole) = (times_ns.map(since_s), since_s(gap.last_ns));
    let grown = |power: i32| {
        if gap.closed { whole.powi(power) * (to - from) / whole } else { to.powi(power) - from.powi(power) }
    };
    covariance[(1, 1)] += options.unseen_turn_rad.powi(2) * grown(3);
    covariance[(5, 5)] += (options.unseen_acceleration_mps2 / 2.0).powi(2) * grown(4);
}
