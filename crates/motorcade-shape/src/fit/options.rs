//! What can be chosen about the fit.

use motorcade_geometry::robust::Kernel;

/// How pose and shape are refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitMethod {
    /// Pose and shape in turn (the paper, equations 7 and 8), so many rounds.
    Alternating {
        /// Rounds of pose, then shape.
        rounds: usize,
    },
    /// Pose and shape at once: fewer steps to the same minimum.
    Joint,
}

/// Settings of a fit; the defaults work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Keypoints below this confidence do not count as measurements. Measured on the network outputs at hand: below 0.1
    /// they lie anywhere in the crop.
    pub min_confidence: f64,
    /// How far a vehicle's true keypoint lies off the deformed mean (standard deviation per axis) \[m\]: the basis is
    /// small, and networks were taught by other hands than drew our cars.
    pub keypoint_sigma_m: f64,
    /// Kernel on the whitened squared distance of a keypoint (2 degrees of freedom).
    pub kernel: Kernel,
    /// Headings tried, evenly over the circle.
    pub headings: usize,
    /// The best of those that are refined; at least 2.
    pub refined: usize,
    /// Deformations used, the widest first; at most [`MAX_SHAPE`](crate::fit::MAX_SHAPE).
    pub deformations: usize,
    /// Joint or alternating.
    pub method: FitMethod,
    /// Steps of a refinement at most.
    pub max_iterations: usize,
    /// Whether it counts that points on faces turned away are unseen and those on faces turned to the camera are seen.
    pub visibility: bool,
    /// Cost of taking all left points for right ones: −2 ln of how often a network does that (5 %).
    pub swap_cost: f64,
    /// Without a road plane: how far vehicle and camera may lean against each other \[rad\].
    pub level_sigma_rad: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            min_confidence: 0.1,
            keypoint_sigma_m: 0.05,
            // χ² of 2 degrees of freedom stays under 5.99 in 95 %.
            kernel: Kernel::Cauchy(2.447_7),
            headings: 12,
            refined: 4,
            deformations: super::MAX_SHAPE,
            method: FitMethod::Joint,
            max_iterations: 20,
            visibility: true,
            swap_cost: 6.0,
            level_sigma_rad: 5.0_f64.to_radians(),
        }
    }
}
