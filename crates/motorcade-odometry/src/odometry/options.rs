//! Options of the odometry.

use crate::map::{MOST_NEIGHBOURS, PictureShiftOptions, PoseOnlyOptions, WindowOptions};
use crate::tracking::{CornerOptions, KltOptions};
use crate::trajectory::ExternalTrajectoryOptions;

/// Times in which sensors read a picture \[s\].
const READOUT_RANGE_S: std::ops::RangeInclusive<f64> = 0.0..=0.2;

/// All options of the odometry.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryOptions {
    /// Corner detection.
    pub corners: CornerOptions,
    /// Tracking.
    pub klt: KltOptions,
    /// Time in which the rows of a picture are read, from the first to the last \[s\]; 0 for a global shutter. The `readout_ms` of a camera
    /// file sets it.
    pub readout_s: f64,
    /// Seed of the two-view sampling.
    pub seed: u64,
    /// Steps of the odometry.
    pub advanced: AdvancedOdometryOptions,
}

/// Steps of the odometry.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedOdometryOptions {
    /// Pose against the map.
    pub pose: PoseOnlyOptions,
    /// Local map.
    pub window: WindowOptions,
    /// Initialisation, keyframes and breaks.
    pub policy: PolicyOptions,
    /// Feedback of the road and of static vehicles.
    pub feedback: FeedbackOptions,
    /// Jumps of the whole picture, which are reported.
    pub picture_shift: PictureShiftOptions,
    /// A trajectory from elsewhere in place of the odometry.
    pub external: ExternalTrajectoryOptions,
}

impl OdometryOptions {
    /// The first setting out of its range, with what it must be; all are usable otherwise.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        if !READOUT_RANGE_S.contains(&self.readout_s) {
            return Err("odometry.readout_s must lie between 0 and 0.2".to_owned());
        }
        let AdvancedOdometryOptions { pose, window, policy, feedback, picture_shift, external } =
            &self.advanced;
        for (name, value, least, most) in [
            ("corners.columns", self.corners.columns, 4, 200),
            ("corners.per_cell", self.corners.per_cell, 1, 100),
            ("klt.max_iterations", self.klt.max_iterations, 1, 1000),
            ("klt.advanced.pyramid_levels", self.klt.advanced.pyramid_levels, 1, 16),
            ("advanced.pose.max_iterations", pose.max_iterations, 1, 1000),
            ("advanced.window.free_keyframes", window.free_keyframes, 3, 1000),
            ("advanced.window.fixed_keyframes", window.fixed_keyframes, 2, 1000),
            ("advanced.picture_shift.iterations", picture_shift.iterations, 1, 100),
            ("advanced.window.depth_neighbours", window.depth_neighbours, 1, MOST_NEIGHBOURS),
        ] {
            if !(least..=most).contains(&value) {
                return Err(format!("odometry.{name} must lie between {least} and {most}"));
            }
        }
        for (name, value) in [
            ("corners.distance_px", self.corners.distance_px),
            ("advanced.pose.kernel_px", pose.kernel_px),
            ("advanced.picture_shift.least_px", picture_shift.least_px),
            ("advanced.picture_shift.most_rest", picture_shift.most_rest),
            ("advanced.picture_shift.least_sigmas", picture_shift.least_sigmas),
            ("advanced.pose.inlier_px", pose.inlier_px),
            ("advanced.window.outlier_px", window.outlier_px),
            ("advanced.window.bundle.kernel_px", window.bundle.kernel_px),
            ("advanced.window.depth_row_weight", window.depth_row_weight),
            ("advanced.policy.begin_flow_rad", policy.begin_flow_rad),
            ("advanced.policy.keyframe_flow_rad", policy.keyframe_flow_rad),
            ("advanced.policy.give_up_s", policy.give_up_s),
            ("advanced.policy.median_depth", policy.median_depth),
            ("advanced.feedback.height_sigma", feedback.height_sigma),
            ("advanced.feedback.most_unit_change", feedback.most_unit_change),
            ("advanced.feedback.unit_lost_s", feedback.unit_lost_s),
            ("advanced.feedback.most_depth_ratio", feedback.most_depth_ratio),
            ("advanced.feedback.most_climb_heights", feedback.most_climb_heights),
            ("advanced.external.rotation_sigma_rad", external.rotation_sigma_rad),
            ("advanced.external.step_sigma_share", external.step_sigma_share),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(format!("odometry.{name} must be positive"));
            }
        }
        Ok(())
    }
}

/// Initialisation, keyframes and breaks.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PolicyOptions {
    /// Median image motion that initialises a map \[rad, pixels over focal length\]: 8 px of a KITTI camera. At five frames a second corners
    /// near the camera are lost from one frame to the next, and those that are left move by 8 to 11 px in 0.2 s.
    pub begin_flow_rad: f64,
    /// Tracks needed for it.
    pub begin_tracks: usize,
    /// Median image motion of landmarks since the last keyframe that requires another \[rad\]: 30 px of a KITTI camera.
    pub keyframe_flow_rad: f64,
    /// Share of the last keyframe's landmarks still tracked below which another is required.
    pub keyframe_kept: f64,
    /// Median image motion below which the camera stands still \[px\]: above the noise of tracking.
    pub standstill_px: f64,
    /// Landmarks that must agree with a pose.
    pub least_inliers: usize,
    /// Time of failed frames after which a new segment starts \[s\].
    pub give_up_s: f64,
    /// Share of the landmarks that must agree with a pose.
    pub least_inlier_share: f64,
    /// Time for which a landmark may be an outlier before it is removed \[s\].
    pub outlier_s: f64,
    /// Least time over which a standstill is tested \[s\]: shorter motions are below the noise of tracking.
    pub standstill_s: f64,
    /// Depth without any landmark nearby \[odometry units\]: practically no parallax.
    pub far_depth: f64,
    /// Tracks below which initialisation never succeeds; small and plain images have few corners.
    pub least_tracks: usize,
    /// Share of the first corners that must still be tracked, where that is less than `begin_tracks`.
    pub begin_kept: f64,
    /// Least median motion of an initialisation \[px\]: below, the noise of tracking passes for parallax.
    pub begin_flow_px: f64,
    /// Pixel noise of the two-view geometry \[px\].
    pub two_view_noise_px: f64,
    /// Share of the tracks that must agree with the two-view geometry.
    pub two_view_inlier_share: f64,
    /// Median depth of a new map, which sets its unit: about a street's in metres.
    pub median_depth: f64,
    /// Time before the first frame of a map for which its speed is extrapolated \[s\].
    pub backwards_s: f64,
    /// Intervals between frames after which a frame that is not located comes late, because the clock has jumped: it is then looked for one
    /// interval ahead. Chosen, not measured: fewer also try this where frames are missing, which costs another tracking.
    pub late_intervals: u32,
    /// Standard deviation of the rotation between two views alone \[rad\]. Median errors on driving pairs (0.9 m ahead, 0.4 px
    /// of noise) are 0.015° of rotation and 0.33° of direction.
    pub two_view_rotation_sigma_rad: f64,
    /// Standard deviation of the direction of translation between them \[rad\].
    pub two_view_direction_sigma_rad: f64,
}

impl Default for PolicyOptions {
    fn default() -> Self {
        Self {
            begin_flow_rad: 0.0111,
            begin_tracks: 60,
            keyframe_flow_rad: 0.0416,
            keyframe_kept: 0.5,
            standstill_px: 0.25,
            least_inliers: 15,
            give_up_s: 0.45,
            least_inlier_share: 0.4,
            outlier_s: 0.25,
            standstill_s: 0.095,
            far_depth: 1e4,
            least_tracks: 20,
            begin_kept: 0.5,
            begin_flow_px: 4.0,
            two_view_noise_px: 1.0,
            two_view_inlier_share: 0.5,
            median_depth: 15.0,
            backwards_s: 1.0,
            late_intervals: 5,
            two_view_rotation_sigma_rad: 0.02_f64.to_radians(),
            two_view_direction_sigma_rad: 0.4_f64.to_radians(),
        }
    }
}

/// Feedback of the road and of static vehicles.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FeedbackOptions {
    /// Standard deviation of a frame's log height beyond its pixels: heave of the body and unevenness of the road, 3 cm for a car.
    /// Measured on rendered drives against their truth.
    pub height_sigma: f64,
    /// Change of log height above which a measurement is rejected: seven times `height_sigma`.
    pub most_height_change: f64,
    /// Change of log height above which a measurement contradicts the unit of the map: a third of the height, beyond the load of a
    /// car and beyond false alignments of a moment.
    pub most_unit_change: f64,
    /// Time for which every measurement must contradict the unit before a new map is started \[s\]. Shorter times break the drive for
    /// a false road, longer ones leave a wrong unit standing.
    pub unit_lost_s: f64,
    /// Largest factor between the median depth of the landmarks and that of a new map; beyond it the map is started anew, as no road is
    /// looked for in such a unit. A narrow street and an open motorway are 50 apart.
    pub most_depth_ratio: f64,
    /// Climb of the road between a keyframe and the next measurement from which on the keyframe gets no plane \[camera heights\]:
    /// larger ones come from false alignments. A larger limit constrains more keyframes and admits more false planes.
    pub most_climb_heights: f64,
    /// Standard deviation of a measurement's pitch from which the keyframe gets no plane \[rad\], 0.3°: the direction of travel
    /// alone does not know how the body swings.
    pub most_pitch_sigma_rad: f64,
    /// Distance of a box's bottom edge beyond which it does not determine depth \[camera heights\]: 33 m for a car.
    pub farthest_vehicle_heights: f64,
    /// Depth of the near part of a static vehicle over that of the road at its bottom edge: a quarter less for boxes that end
    /// above the tyres, a fifth more for receding bodies. Oncoming vehicles show 0.5 or less, vehicles ahead 2 or more;
    /// inside remain those slower than about a fifth of the camera's speed.
    pub static_depth_ratio: [f64; 2],
    /// Share of a vehicle's landmarks that are nearer than its near part.
    pub near_share: f64,
    /// Landmarks needed on a vehicle.
    pub least_landmarks: usize,
    /// A box that ends this near to the bottom of the image is truncated \[px\].
    pub truncated_px: f64,
    /// Time for which a vehicle must be classified as static before its landmarks are used \[s\].
    pub static_s: f64,
}

impl Default for FeedbackOptions {
    fn default() -> Self {
        Self {
            height_sigma: 0.02,
            most_height_change: 0.15,
            most_unit_change: 0.3,
            unit_lost_s: 2.0,
            most_depth_ratio: 60.0,
            most_climb_heights: 0.5,
            most_pitch_sigma_rad: 5e-3,
            farthest_vehicle_heights: 20.0,
            static_depth_ratio: [0.75, 1.2],
            near_share: 0.25,
            least_landmarks: 4,
            truncated_px: 3.0,
            static_s: 0.25,
        }
    }
}
