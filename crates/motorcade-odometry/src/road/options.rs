//! Options of the road. Lengths are in camera heights, so that nothing depends on the unknown unit of the odometry.

use super::height::HeightOptions;
use crate::tracking::CornerOptions;

/// The stretch of road that is aligned, and how often.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RoadOptions {
    /// Far end of the stretch of road used \[camera heights\]; 15 heights are 25 m for a car.
    pub far_heights: f64,
    /// Half width of that stretch with a road mask \[camera heights\]: 1.7 heights are 2.8 m, the own lane. The whole
    /// carriageway with its crown and kerbs is less often a plane.
    pub half_width_heights: f64,
    /// Half width without a mask \[camera heights\]: 0.7 heights are 1.15 m, the path of the car itself. Kerbs and verges
    /// beyond would tilt and lower the plane.
    pub unmasked_half_width_heights: f64,
    /// Least time between two aligned frames \[s\]: frames in between share heave, texture and noise, and cost time.
    pub interval_s: f64,
    /// Standard deviation of the road's vertical curvature times the camera's height: 0.001 is a radius of 1650 m under a
    /// camera at 1.65 m. Hilly drives are better served by 0.002; a flat street's crown then passes for height. Zero takes
    /// the road as a plane.
    pub curvature_sigma: f64,
    /// Time in which the rows of a picture are read, from the first to the last \[s\]; 0 for a global shutter. The `readout_ms` of a camera
    /// file sets it.
    pub readout_s: f64,
    /// False holds the normal at (0, −1, 0), a level road and a camera looking along it, as the paper does.
    pub free_normal: bool,
    /// Settings that rarely need a change.
    pub advanced: AdvancedRoadOptions,
}

impl Default for RoadOptions {
    fn default() -> Self {
        Self {
            far_heights: 15.0,
            half_width_heights: 1.7,
            unmasked_half_width_heights: 0.7,
            interval_s: 0.08,
            curvature_sigma: 0.001,
            readout_s: 0.0,
            free_normal: true,
            advanced: AdvancedRoadOptions::default(),
        }
    }
}

/// Pairs of frames, alignment and tracking of the road plane, and search of the camera's height.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedRoadOptions {
    /// Least distance between the two frames \[camera heights\]. Longer baselines are more precise and align less often.
    pub baseline_heights: f64,
    /// Largest age of the earlier frame \[s\].
    pub oldest_s: f64,
    /// True compares only pixels that were road in the earlier picture, too; false accepts vehicles there.
    pub both_pictures: bool,
    /// Alignment of two frames.
    pub alignment: AlignmentOptions,
    /// The camera's height by accumulated likelihood.
    pub height: HeightOptions,
    /// Tracking of a known plane.
    pub tracking: PlaneTrackingOptions,
}

impl Default for AdvancedRoadOptions {
    fn default() -> Self {
        Self {
            baseline_heights: 1.2,
            oldest_s: 1.55,
            both_pictures: true,
            alignment: AlignmentOptions::default(),
            height: HeightOptions::default(),
            tracking: PlaneTrackingOptions::default(),
        }
    }
}

/// Alignment of two frames.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AlignmentOptions {
    /// Pyramid levels, coarse to fine.
    pub levels: usize,
    /// Iterations on each level.
    pub iterations: usize,
    /// Standard deviation of the odometry's rotation between the two frames \[rad\]: 0.02° of pitch moves the road as much
    /// as 1 % of scale.
    pub rotation_sigma_rad: f64,
    /// Standard deviation of pitch and roll about the expected plane \[rad\].
    pub tilt_sigma_rad: f64,
    /// Pixels with a smaller gradient carry no information \[grey levels/px\].
    pub least_gradient: f32,
    /// Pixels used at most on a level: precision against time.
    pub most_pixels: usize,
    /// Pixels needed.
    pub least_pixels: usize,
    /// Share of the pixels that must agree with the plane.
    pub least_agreement: f64,
    /// Neighbouring pixels share interpolation, texture and noise: this many count as one measurement.
    pub correlated_pixels: f64,
    /// Standard deviation of the grey residual at the start \[grey levels\]; estimated afterwards.
    pub initial_sigma_grey: f64,
    /// Its least estimate \[grey levels\]: rounding of the pixels.
    pub least_sigma_grey: f64,
    /// Scale of the Cauchy kernel \[standard deviations of the grey residual\].
    pub kernel_sigmas: f64,
    /// Residual up to which a pixel agrees \[standard deviations\].
    pub agreement_sigmas: f64,
    /// Least standard deviation of the residuals in the test of `agreement_sigmas` \[grey levels\].
    pub agreement_sigma_grey: f64,
    /// Relative change of the plane that ends the iteration.
    pub converged: f64,
    /// Angle to the expected plane beyond which a plane is rejected \[`tilt_sigma_rad`\].
    pub tilt_gate: f64,
    /// Prior variance of the gain between the two images: ±10 %.
    pub gain_variance: f64,
    /// Prior variance of the grey offset between them \[grey levels²\]: ±10.
    pub offset_variance: f64,
    /// Standard deviation of the tilt with a held normal \[rad\]: practically none.
    pub held_tilt_sigma_rad: f64,
}

impl Default for AlignmentOptions {
    fn default() -> Self {
        Self {
            levels: 2,
            iterations: 8,
            rotation_sigma_rad: 0.02_f64.to_radians(),
            tilt_sigma_rad: 1.5_f64.to_radians(),
            least_gradient: 2.0,
            most_pixels: 8000,
            least_pixels: 300,
            least_agreement: 0.5,
            correlated_pixels: 8.0,
            initial_sigma_grey: 8.0,
            least_sigma_grey: 0.5,
            kernel_sigmas: 2.0,
            agreement_sigmas: 2.5,
            agreement_sigma_grey: 2.0,
            converged: 1e-5,
            tilt_gate: 6.0,
            gain_variance: 0.01,
            offset_variance: 100.0,
            held_tilt_sigma_rad: 1e-5,
        }
    }
}

/// Tracking of a known plane.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlaneTrackingOptions {
    /// Gain of the tracked plane per measurement: the noise of one frame must not move the start of the next far away.
    pub gain: f64,
    /// Time constant of the mean normal about which pitch and roll are estimated \[s\]: where there is little texture they would
    /// walk away from measurement to measurement.
    pub normal_s: f64,
    /// Change of log height from one measurement to the next above which it is rejected: five times its scatter of 0.03.
    pub most_jump: f64,
    /// Change of log height over many seconds above which it is rejected: the road inside the adjustment holds the unit of
    /// the odometry to a few percent.
    pub most_drift: f64,
    /// Time constant of the height that this drift is measured against \[s\].
    pub anchor_s: f64,
    /// Time of failed alignments after which the plane is searched again \[s\].
    pub give_up_s: f64,
    /// Time without a plane after which the segment's earlier height is no longer required \[s\].
    pub distrust_anchor_s: f64,
    /// Height of a vehicle's shadow on the road below its box \[box heights\].
    pub shadow: f64,
    /// Border around a box that is half vehicle, half road \[px\].
    pub rim_px: f64,
    /// Half width to which the unmasked stretch grows while alignments fail or find little texture \[camera heights\]: small
    /// pictures, smooth asphalt.
    pub unmasked_widest_heights: f64,
    /// Pixels below which the unmasked stretch grows, and above twice of which it shrinks again.
    pub unmasked_pixels: usize,
    /// Factor of each change of that half width.
    pub width_step: f64,
}

impl Default for PlaneTrackingOptions {
    fn default() -> Self {
        Self {
            gain: 0.3,
            normal_s: 3.0,
            most_jump: 0.15,
            most_drift: 0.3,
            anchor_s: 10.0,
            give_up_s: 0.75,
            distrust_anchor_s: 3.05,
            shadow: 0.15,
            rim_px: 4.0,
            unmasked_widest_heights: 1.0,
            unmasked_pixels: 2500,
            width_step: 1.1,
        }
    }
}

/// Vertical curvature of the road from the driven trajectory.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ProfileOptions {
    /// Distance ahead and back over which the trajectory is used \[camera heights\]: as far as the road is aligned. Not a setting of its own in the
    /// configuration of a run, where it is `road.far_heights`.
    #[serde(skip)]
    pub reach_heights: f64,
    /// Heave of the body and unevenness of the road over one camera height driven \[camera heights\]: 1.6 cm for a car.
    pub unevenness_heights: f64,
    /// Standard deviation of the difference between the curvatures behind and ahead, times camera height.
    pub change_sigma: f64,
    /// Standard deviation of the road's roll \[rad\]: in a bend the trajectory leads aside, where roll looks like a hill.
    pub roll_sigma_rad: f64,
    /// Standard deviation of curvature times camera height: 0.004 is a crest of 400 m radius under a car's camera.
    pub curvature_sigma: f64,
    /// Inverse variance of offset and slope: a tenth of a camera height, a slope of a tenth.
    pub line_information: f64,
    /// Least time between two frames used \[s\]; bounds the cost at high frame rates.
    pub interval_s: f64,
}

impl Default for ProfileOptions {
    fn default() -> Self {
        Self {
            reach_heights: 15.0,
            unevenness_heights: 0.01,
            change_sigma: 5e-4,
            roll_sigma_rad: 0.01,
            curvature_sigma: 4e-3,
            line_information: 100.0,
            interval_s: 0.08,
        }
    }
}

/// The paper's closed form.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClosedFormOptions {
    /// Farthest road point used \[camera heights\]: the paper's T = 12 m over its camera's height of 1.65 m.
    pub farthest_heights: f64,
    /// Average of the scales of a frame.
    pub average: ScaleAverage,
    /// Settings that rarely need a change.
    pub advanced: AdvancedClosedFormOptions,
}

impl Default for ClosedFormOptions {
    fn default() -> Self {
        Self {
            farthest_heights: 12.0 / 1.65,
            average: ScaleAverage::Mean,
            advanced: AdvancedClosedFormOptions::default(),
        }
    }
}

/// Road corners and their matches.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedClosedFormOptions {
    /// Corners of the road: weak ones, because asphalt has no others, and many.
    pub corners: CornerOptions,
    /// Least smaller eigenvalue of a matched corner's template \[(grey levels/px)²\]: a third of the odometry's, for asphalt. Smaller
    /// values give more matches, and worse ones.
    pub least_eigenvalue: f32,
    /// Least time between two compared frames \[s\]; the paper compares consecutive frames at 10 frames/s.
    pub interval_s: f64,
    /// Half width of the stretch whose corners are used \[camera heights\]: 2.5 heights are 4 m.
    pub half_width_heights: f64,
    /// Matches needed.
    pub least_matches: usize,
    /// Camera height before the first scale \[odometry units\]; predicts where road points go.
    pub guess_units: f64,
    /// Variance of pitch and roll, which are assumed zero \[rad²\]: 0.6°.
    pub tilt_variance_rad2: f64,
    /// Least variance of log scale.
    pub least_variance: f64,
}

impl Default for AdvancedClosedFormOptions {
    fn default() -> Self {
        Self {
            corners: CornerOptions {
                columns: 41,
                per_cell: 2,
                distance_px: 7.0,
                least_eigenvalue: 2.0,
                border_px: 12,
            },
            least_eigenvalue: 1.0,
            interval_s: 0.08,
            half_width_heights: 2.5,
            least_matches: 5,
            guess_units: 2.0,
            tilt_variance_rad2: 1e-4,
            least_variance: 1e-8,
        }
    }
}

/// Average of the scales of many matches.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum ScaleAverage {
    /// Eq. (5).
    #[default]
    Mean,
    /// Robust against wrong matches, not against a wrong plane.
    Median,
}
