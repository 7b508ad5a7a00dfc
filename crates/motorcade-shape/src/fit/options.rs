//! Options of the fit.

use motorcade_geometry::robust::RobustKernel;

/// Method of refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitMethod {
    /// Pose and shape in turn (the paper, equations 7 and 8).
    Alternating {
        /// Rounds of pose, then shape.
        rounds: usize,
    },
    /// Pose and shape at once: fewer steps to the same minimum.
    Joint,
}

/// Options of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Confidence from which a keypoint is a measurement. Below 0.1 the outputs of the network at hand are anywhere in the crop.
    pub min_confidence: f64,
    /// Standard deviation of a true keypoint about the deformed mean, per axis \[m\]: the basis is small, and annotators of
    /// networks place points differently.
    pub keypoint_sigma_m: f64,
    /// Kernel on the whitened squared distance of a keypoint (2 degrees of freedom).
    pub kernel: RobustKernel,
    /// Headings tried, evenly over the circle.
    pub headings: usize,
    /// Most likely headings that are refined; at least 2.
    pub refined: usize,
    /// Deformations used, the widest first; at most [`MAX_SHAPE`](crate::fit::MAX_SHAPE).
    pub deformations: usize,
    /// Joint or alternating.
    pub method: FitMethod,
    /// Most steps of a refinement.
    pub max_iterations: usize,
    /// True to use which points were found: those on faces turned away should be missing.
    pub visibility: bool,
    /// Cost of exchanging left and right points: −2 ln of how often a network does that (5 %).
    pub swap_cost: f64,
    /// Without a road plane: standard deviation of roll and pitch between vehicle and camera \[rad\].
    pub level_sigma_rad: f64,
    /// Visibility and box-edge terms.
    pub advanced: AdvancedFitOptions,
}

/// Parameters of the visibility and box-edge terms. Costs are −2 ln of probabilities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdvancedFitOptions {
    /// Width of the transition from invisible to visible in the cosine of a face.
    pub visibility_sigma: f64,
    /// Cost of a missing point that faces the camera: 30 % are occluded or dark.
    pub missing_in_front_cost: f64,
    /// Cost of a found point on a face turned away: networks place 3 % of them.
    pub visible_behind_cost: f64,
    /// Number of points for which these costs were tuned (the layout of 14); more points share them.
    pub visibility_points: f64,
    /// Scale of the Cauchy kernel on whitened residuals of box edges.
    pub box_edge_scale: f64,
}

impl Default for AdvancedFitOptions {
    fn default() -> Self {
        Self {
            visibility_sigma: 0.2,
            missing_in_front_cost: 2.4,
            visible_behind_cost: 7.0,
            visibility_points: 14.0,
            box_edge_scale: 2.0,
        }
    }
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            min_confidence: 0.1,
            keypoint_sigma_m: 0.05,
            // √ of the 95 % quantile of χ²₂.
            kernel: RobustKernel::Cauchy(2.447_7),
            headings: 12,
            refined: 4,
            deformations: super::MAX_SHAPE,
            method: FitMethod::Joint,
            max_iterations: 20,
            visibility: true,
            swap_cost: 6.0,
            level_sigma_rad: 5.0_f64.to_radians(),
            advanced: AdvancedFitOptions::default(),
        }
    }
}
