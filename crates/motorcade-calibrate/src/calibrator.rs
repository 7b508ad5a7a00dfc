//! The calibration: passes over the drive until the focal length stays.

use crate::adjustment::Adjustment;
use crate::estimate::LensEstimate;
use crate::lens::Lens;
use crate::options::{CalibrateOptions, ViewPrior};
use crate::pass::Pass;
use crate::prior::LensPrior;

/// Cauchy scale over the noise of a corner, derived: 95 % efficient for normal errors.
const KERNEL_SIGMAS: f64 = 2.385;

/// Cauchy scale for a noise of this size \[px\].
pub(crate) fn kernel_px(noise_px: f64, options: &CalibrateOptions) -> f64 {
    (KERNEL_SIGMAS * noise_px).max(options.advanced.least_kernel_px)
}

/// Finds the lens of a camera in passes over a drive: at first without distortion, then with it.
///
/// The odometry needs a focal length to choose its points and to start the adjustment from; that of one pass serves the next. What
/// makes the focal length known is turning: of a camera that turns, far points move faster the farther they are from the axis, by
/// `1 + tan²`; in straight motion every focal length explains the pictures, with other depths.
#[derive(Clone, Debug)]
pub struct Calibrator {
    options: CalibrateOptions,
    size: (u32, u32),
    guess: Lens,
    prior: ViewPrior,
    lens: Lens,
    passes: usize,
    /// Cauchy scale \[px\], by the errors of the pass before.
    kernel_px: f64,
    /// True from the passes on that look for distortion.
    bent: bool,
    estimate: Option<LensEstimate>,
}

impl Calibrator {
    /// For pictures of this size \[px\].
    pub fn new(width: u32, height: u32, prior: ViewPrior, options: CalibrateOptions) -> Self {
        let guess = Lens::centred(prior.focal_px(width), width, height);
        Self {
            options,
            size: (width, height),
            guess,
            prior,
            lens: guess,
            passes: 0,
            kernel_px: options.advanced.kernel_px,
            bent: false,
            estimate: None,
        }
    }

    /// The next pass; every frame of the drive goes into it.
    pub fn pass(&self) -> Pass {
        Pass::new(self.lens, self.size.0, self.size.1, &self.options)
    }

    /// Takes a pass that is through; true when no other is needed.
    pub fn take(&mut self, pass: Pass) -> bool {
        let mut options = self.options;
        options.advanced.kernel_px = self.kernel_px;
        let options = &options;
        self.passes += 1;
        let windows = pass.windows(options);
        if windows.is_empty() {
            return true;
        }
        let k1_sigma = if self.bent { options.k1_sigma } else { 1e-6 };
        let prior = LensPrior::new(self.guess, [self.prior.log_sigma, k1_sigma], self.size.0, options);
        let mut adjustment = Adjustment { lens: self.lens, windows };
        adjustment.solve(&prior, options);
        let estimate = LensEstimate::new(&adjustment, &prior, options);
        let change = (estimate.lens.focal_px / self.lens.focal_px).ln().abs();
        self.lens = estimate.lens;
        self.kernel_px = kernel_px(estimate.noise_px(), options);
        self.estimate = Some(estimate);
        let settled = change < options.advanced.converged || self.passes >= options.advanced.passes;
        if settled && !self.bent {
            (self.bent, self.passes) = (true, 0);
            return false;
        }
        settled
    }

    /// The lens; `None` where the camera did not move enough.
    pub fn finish(self) -> Option<LensEstimate> {
        self.estimate
    }
}
