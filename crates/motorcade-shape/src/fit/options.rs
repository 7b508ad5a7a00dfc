//! Options of the fit.

use motorcade_geometry::robust::RobustKernel;

use super::MAX_SHAPE;

/// Method of refinement.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum FitMethod {
    /// Pose and shape in turn (the paper, equations 7 and 8).
    Alternating,
    /// Pose and shape at once: fewer steps to the same minimum.
    #[default]
    Joint,
}

/// Options of a fit. In files both levels are one table: the configuration of a run has it below its own `advanced`, and refuses names that it does
/// not know by itself, because flattened fields exclude serde's check.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct FitOptions {
    /// Confidence from which a keypoint is a measurement. Below 0.1 the outputs of the network at hand are anywhere in the crop.
    pub min_confidence: f64,
    /// Standard deviation of a true keypoint about the deformed mean, per axis \[m\]: the basis is small, and annotators of
    /// networks place points differently.
    pub keypoint_sigma_m: f64,
    /// Scale of the Cauchy kernel on the whitened distance of a keypoint \[standard deviations\]: √ of the 95 % quantile of χ²₂.
    pub kernel_scale: f64,
    /// Headings tried, evenly over the circle.
    pub headings: usize,
    /// Most likely headings that are refined; at least 2.
    pub refined: usize,
    /// Deformations used, the widest first; at most `MAX_SHAPE`.
    pub deformations: usize,
    /// Joint or alternating.
    pub method: FitMethod,
    /// Rounds of pose, then shape, of the alternating method.
    pub rounds: usize,
    /// Most steps of a refinement.
    pub max_iterations: usize,
    /// True to use which points were found: those on faces turned away should be missing.
    pub visibility: bool,
    /// Cost of exchanging left and right points: −2 ln of how often a network does that (5 %).
    pub swap_cost: f64,
    /// Without a road plane: standard deviation of roll and pitch between vehicle and camera \[rad\].
    pub level_sigma_rad: f64,
    /// Visibility term, initial poses and steps.
    #[serde(flatten)]
    pub advanced: AdvancedFitOptions,
}

impl FitOptions {
    /// Kernel of a keypoint.
    pub(super) fn kernel(&self) -> RobustKernel {
        RobustKernel::Cauchy(self.kernel_scale)
    }

    /// The first setting out of its range, with what it must be; all are usable otherwise.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        let check = |ok: bool, text: String| if ok { Ok(()) } else { Err(text) };
        check(self.headings >= 1, "fit.headings must be at least 1".into())?;
        check(self.refined >= 2, "fit.refined must be at least 2".into())?;
        check(self.deformations <= MAX_SHAPE, format!("fit.deformations must be at most {MAX_SHAPE}"))?;
        check(self.rounds >= 1, "fit.rounds must be at least 1".into())?;
        for (name, value) in [
            ("keypoint_sigma_m", self.keypoint_sigma_m),
            ("kernel_scale", self.kernel_scale),
            ("level_sigma_rad", self.level_sigma_rad),
            ("visibility_sigma", self.advanced.visibility_sigma),
            ("visibility_points", self.advanced.visibility_points),
            ("lean_sigma_rad", self.advanced.lean_sigma_rad),
            ("first_height_m", self.advanced.first_height_m),
            ("first_distance_m", self.advanced.first_distance_m[0]),
            ("first_distance_m", self.advanced.first_distance_m[1]),
            ("start_distance_m", self.advanced.start_distance_m),
            ("farthest_m", self.advanced.farthest_m),
            ("step_rad", self.advanced.step_rad),
            ("step_share", self.advanced.step_share),
            ("step_m", self.advanced.step_m),
            ("step_sigmas", self.advanced.step_sigmas),
        ] {
            check(value.is_finite() && value > 0.0, format!("fit.{name} must be positive"))?;
        }
        Ok(())
    }
}

/// Parameters of the visibility term, of initial poses and of steps. Costs are −2 ln of probabilities.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedFitOptions {
    /// Width of the transition from invisible to visible in the cosine of a face.
    pub visibility_sigma: f64,
    /// Cost of a missing point that faces the camera: 30 % are occluded or dark.
    pub missing_in_front_cost: f64,
    /// Cost of a found point on a face turned away: networks place 3 % of them.
    pub visible_behind_cost: f64,
    /// Number of points for which these costs were tuned (the layout of 14); more points share them.
    pub visibility_points: f64,
    /// Probability that a network's heading is unrelated to the vehicle.
    pub heading_unrelated: f64,
    /// Standard deviation of roll and pitch of a vehicle against the road \[rad\], suspension and load, besides the road's slope: 1°. Chosen: a
    /// larger one lets misplaced points tilt the vehicle.
    pub lean_sigma_rad: f64,
    /// Height that the keypoints span in a first guess of the distance \[m\]: a car's. It only weights the first linear position.
    pub first_height_m: f64,
    /// Least and greatest distance of that guess \[m\]: where vehicles are seen. Keypoints in one row or outliers give any distance.
    pub first_distance_m: [f64; 2],
    /// Distance of a vehicle before the first estimate \[m\]: it only weights the first linear position. Chosen; another one takes more steps.
    pub start_distance_m: f64,
    /// Reweighted rounds of the linear position that a refinement starts from. Chosen, not measured: more resist more outliers and take longer.
    pub placement_rounds: usize,
    /// Largest distance of a linear position \[m\]; beyond it there is none. Chosen: no keypoints are seen from there.
    pub farthest_m: f64,
    /// Height of the middle of a body over its road where the road is unknown \[m\]: half of a car's. It only places the first guess.
    pub body_centre_m: f64,
    /// Cosine between two initial headings below which one is the opposite of the other, which is refined too: more than 114° apart. Chosen: a
    /// smaller one asks for an exacter opposite, and may find none.
    pub opposite_cosine: f64,
    /// Cosine between two initial headings above which only the more likely one is refined: neighbours of twelve on the circle, 30° apart,
    /// converge to the same minimum. A smaller one spreads the refined headings farther.
    pub same_cosine: f64,
    /// Cost by which the opposite heading of an ambiguous frame must be better under the shape of the track. Chosen, not measured: a larger one
    /// keeps more headings that were found alone.
    pub flip_gain: f64,
    /// Longest rotation of one step \[rad\]: half a radian, within which the linear model holds. Longer steps (of these four limits) need
    /// fewer iterations and fail more often.
    pub step_rad: f64,
    /// Longest motion of one step as a share of the distance.
    pub step_share: f64,
    /// Longest motion of one step near the camera \[m\].
    pub step_m: f64,
    /// Longest deformation of one step \[standard deviations of the shape prior\].
    pub step_sigmas: f64,
}

impl AdvancedFitOptions {
    /// First guess of the distance of keypoints that span `span_px` \[m\].
    pub(super) fn first_distance_m(&self, focal_px: f64, span_px: f64) -> f64 {
        let [least, most] = self.first_distance_m;
        (focal_px * self.first_height_m / span_px.max(1.0)).min(most).max(least)
    }
}

impl Default for AdvancedFitOptions {
    fn default() -> Self {
        Self {
            visibility_sigma: 0.2,
            missing_in_front_cost: 2.4,
            visible_behind_cost: 7.0,
            visibility_points: 14.0,
            heading_unrelated: 0.05,
            lean_sigma_rad: 1.0_f64.to_radians(),
            first_height_m: 1.5,
            first_distance_m: [3.0, 100.0],
            start_distance_m: 15.0,
            placement_rounds: 4,
            farthest_m: 500.0,
            body_centre_m: 0.8,
            opposite_cosine: -0.4,
            same_cosine: 0.8,
            flip_gain: 1.0,
            step_rad: 0.5,
            step_share: 0.4,
            step_m: 0.5,
            step_sigmas: 4.0,
        }
    }
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            min_confidence: 0.1,
            keypoint_sigma_m: 0.05,
            kernel_scale: 2.447_7,
            headings: 12,
            refined: 4,
            deformations: MAX_SHAPE,
            method: FitMethod::Joint,
            rounds: 40,
            max_iterations: 20,
            visibility: true,
            swap_cost: 6.0,
            level_sigma_rad: 5.0_f64.to_radians(),
            advanced: AdvancedFitOptions::default(),
        }
    }
}
