//! Soft length of the baseline between two keyframes, inside the bundle adjustment.

use motorcade_geometry::{Camera, Pose, World, robust::RobustKernel};
use nalgebra::{Vector3, Vector6};

use super::options::BundleOptions;

type CameraFromWorld = Pose<Camera, World>;

/// A soft distance between the centres of two poses, by index: residual `(ln ‖c_to − c_from‖ − log_length) / sigma`.
#[derive(Clone, Copy, Debug)]
pub struct BaselineLength {
    /// Earlier pose.
    pub from: usize,
    /// Later pose.
    pub to: usize,
    /// Logarithm of the distance.
    pub log_length: f64,
    /// Standard deviation of that logarithm.
    pub sigma: f64,
}

impl BaselineLength {
    /// Residual and its Jacobians by the two poses (1×6 each, right perturbation `[ω, ν]` of `camera_from_world`). `None`
    /// where the centres coincide.
    pub(super) fn linearise(&self, poses: &[CameraFromWorld]) -> Option<(f64, Vector6<f64>, Vector6<f64>)> {
        let centre = |k: usize| poses[k].inverse().translation();
        let (a, b) = (centre(self.from), centre(self.to));
        let between = b - a;
        let length = between.norm();
        if length < 1e-9 {
            return None;
        }
        let along = between / (length * length * self.sigma);
        // c = −(T exp δ)⁻¹·0  ⇒  ∂c/∂ω = c^, ∂c/∂ν = −I
        let by = |c: &Vector3<f64>, sign: f64| {
            let by_turn = along.cross(c) * sign;
            let by_shift = -along * sign;
            Vector6::new(by_turn.x, by_turn.y, by_turn.z, by_shift.x, by_shift.y, by_shift.z)
        };
        Some(((length.ln() - self.log_length) / self.sigma, by(&a, -1.0), by(&b, 1.0)))
    }

    /// Cost \[px²\].
    pub(super) fn cost(&self, poses: &[CameraFromWorld], options: &BundleOptions) -> f64 {
        let residual = self.linearise(poses).map_or(0.0, |(r, _, _)| r);
        let kernel = RobustKernel::Cauchy(options.length_kernel);
        options.pixel_sigma_px * options.pixel_sigma_px * kernel.cost(residual * residual)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::numeric::jacobian_error;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn jacobians_match_differences() {
        let poses: Vec<CameraFromWorld> = vec![
            Pose::exp(&Vector6::new(0.1, -0.2, 0.05, 0.3, -0.1, 0.8)),
            Pose::exp(&Vector6::new(0.1, 0.3, -0.05, 0.5, 0.1, -0.9)),
        ];
        let length = BaselineLength { from: 0, to: 1, log_length: 0.3, sigma: 0.02 };
        let (_, by_from, by_to) = length.linearise(&poses).unwrap();
        let analytic = by_from.iter().chain(&by_to).copied();
        let error = jacobian_error(&DMatrix::from_iterator(1, 12, analytic), |step| {
            let moved = |k: usize| poses[k].retract(&step.fixed_rows::<6>(6 * k).into_owned());
            let residual = length.linearise(&[moved(0), moved(1)]).ok_or(())?.0;
            Ok::<_, ()>(DVector::from_element(1, residual))
        });
        assert!(error.unwrap() < 1e-7);
    }
}
