//! Bundle adjustment of many windows with one lens.

use motorcade_geometry::robust::RobustKernel;
use nalgebra::{Matrix4, Vector4};

use crate::lens::Lens;
use crate::options::CalibrateOptions;
use crate::prior::LensPrior;
use crate::window::Window;

/// Windows of a drive that share a lens.
pub(crate) struct Adjustment {
    pub lens: Lens,
    pub windows: Vec<Window>,
}

impl Adjustment {
    fn cost(&self, prior: &LensPrior, kernel: RobustKernel, behind_px: f64) -> f64 {
        let of_window = |w: &Window| w.cost(&self.lens, kernel, behind_px);
        prior.cost(&self.lens) + self.windows.iter().map(of_window).sum::<f64>()
    }

    /// Levenberg–Marquardt in place.
    pub fn solve(&mut self, prior: &LensPrior, options: &CalibrateOptions) {
        let kernel = RobustKernel::Cauchy(options.advanced.kernel_px);
        let behind_px = options.advanced.behind_px;
        let mut cost = self.cost(prior, kernel, behind_px);
        let mut damping = 1e-3;
        for _ in 0..options.advanced.max_iterations {
            let Some(next) = self.step(prior, kernel, damping) else {
                damping *= 10.0;
                continue;
            };
            let new_cost = next.cost(prior, kernel, behind_px);
            if new_cost < cost {
                let converged = cost - new_cost < options.advanced.relative_decrease * cost
                    && (next.lens.focal_px / self.lens.focal_px).ln().abs() < 1e-4;
                *self = next;
                cost = new_cost;
                damping = (damping * 0.2).max(1e-8);
                if converged {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
    }

    fn step(&self, prior: &LensPrior, kernel: RobustKernel, damping: f64) -> Option<Self> {
        let reduced: Vec<_> =
            self.windows.iter().map(|w| w.reduce(&self.lens, kernel, damping)).collect::<Option<_>>()?;
        let (mut information, mut gradient) = (prior.information(&self.lens), prior.gradient(&self.lens));
        for one in &reduced {
            information += one.information;
            gradient += one.gradient;
        }
        for k in 0..4 {
            information[(k, k)] *= 1.0 + damping;
        }
        let step = information.cholesky()?.solve(&-gradient);
        let windows = self.windows.iter().zip(&reduced).map(|(window, one)| {
            let (poses, corners) = one.substitute(&step);
            window.moved(&poses, &corners)
        });
        Some(Self { lens: self.lens.moved(&step), windows: windows.collect() })
    }

    /// Reduced equations of the lens at the solution, by window: information \[1/px²\] and gradient.
    pub fn votes(&self, options: &CalibrateOptions) -> Vec<(Matrix4<f64>, Vector4<f64>)> {
        let kernel = RobustKernel::Cauchy(options.advanced.kernel_px);
        let one = |w: &Window| w.reduce(&self.lens, kernel, 1e-9).map(|r| (r.information, r.gradient));
        self.windows.iter().filter_map(one).collect()
    }
}
