//! Prior of the lens.

use motorcade_geometry::robust::RobustKernel;
use nalgebra::{Matrix4, Vector4};

use crate::lens::Lens;
use crate::options::CalibrateOptions;

/// Distributions of ln f, k1, cx, cy, in the units of the adjustment's cost \[px²\]: normal ones, and for k1 one with heavy tails. Most
/// pictures have been rectified or come from a good lens; those that have not are far from zero.
pub(crate) struct LensPrior {
    mean: Lens,
    sigmas: Vector4<f64>,
    /// Variance of an observation \[px²\].
    noise: f64,
    k1_kernel: RobustKernel,
}

impl LensPrior {
    /// `log_focal_sigma` and `k1_sigma` are those before the drive.
    pub fn new(
        mean: Lens,
        [log_focal_sigma, k1_sigma]: [f64; 2],
        width: u32,
        options: &CalibrateOptions,
    ) -> Self {
        let centre = options.advanced.centre_sigma * f64::from(width);
        Self {
            mean,
            sigmas: Vector4::new(log_focal_sigma, k1_sigma, centre, centre),
            noise: options.advanced.noise_px * options.advanced.noise_px,
            k1_kernel: RobustKernel::Cauchy(options.advanced.k1_kernel),
        }
    }

    /// Standard deviation of ln f.
    pub fn log_focal_sigma(&self) -> f64 {
        self.sigmas[0]
    }

    /// Differences in standard deviations.
    fn whitened(&self, lens: &Lens) -> Vector4<f64> {
        let mean = &self.mean;
        let difference = Vector4::new(
            (lens.focal_px / mean.focal_px).ln(),
            lens.k1 - mean.k1,
            lens.cx - mean.cx,
            lens.cy - mean.cy,
        );
        difference.component_div(&self.sigmas)
    }

    /// Weights of the squares: k1 counts less the farther it is from zero.
    fn weights(&self, lens: &Lens) -> Vector4<f64> {
        let k1 = self.whitened(lens)[1];
        Vector4::new(1.0, self.k1_kernel.weight(k1 * k1), 1.0, 1.0) * self.noise
    }

    pub fn cost(&self, lens: &Lens) -> f64 {
        let squares = self.whitened(lens).map(|d| d * d);
        self.noise * (squares[0] + self.k1_kernel.cost(squares[1]) + squares[2] + squares[3])
    }

    pub fn information(&self, lens: &Lens) -> Matrix4<f64> {
        let variances = self.sigmas.map(|s| s * s);
        Matrix4::from_diagonal(&self.weights(lens).component_div(&variances))
    }

    /// Information at the mean where k1 may be that of any lens.
    pub fn information_of_any_lens(&self, options: &CalibrateOptions) -> Matrix4<f64> {
        let mut sigmas = self.sigmas;
        sigmas[1] = sigmas[1].max(options.advanced.any_lens_k1_sigma);
        Matrix4::from_diagonal(&sigmas.map(|s| self.noise / (s * s)))
    }

    pub fn gradient(&self, lens: &Lens) -> Vector4<f64> {
        self.whitened(lens).component_mul(&self.weights(lens)).component_div(&self.sigmas)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gradient_is_the_slope_of_half_the_cost() {
        let mean = Lens::centred(700.0, 1242, 375);
        let prior = LensPrior::new(mean, [0.5, 0.005], 1242, &CalibrateOptions::default());
        let at = Lens { focal_px: 800.0, k1: -0.04, cx: 600.0, cy: 200.0 };
        for k in 0..4 {
            let mut step = Vector4::zeros();
            step[k] = 1e-6;
            let slope = 0.5 * (prior.cost(&at.moved(&step)) - prior.cost(&at)) / 1e-6;
            let gradient = prior.gradient(&at)[k];
            assert!((slope - gradient).abs() < 1e-3 * gradient.abs().max(1e-3), "{k}: {slope} {gradient}");
        }
    }
}
