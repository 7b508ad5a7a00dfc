//! Options of the local map, its adjustment, and the pose of a frame against it.

/// Pose of a frame against the map.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PoseOnlyOptions {
    /// Iterations at most.
    pub max_iterations: usize,
    /// Cauchy scale of the reprojection error at the end \[px\].
    pub kernel_px: f64,
    /// Limit of an inlier \[px\].
    pub inlier_px: f64,
    /// First Cauchy scale over the last one: a prediction may be off by tens of pixels.
    pub initial_kernel_ratio: f64,
    /// Factor on the Cauchy scale after each iteration.
    pub kernel_decay: f64,
    /// Norm of the step `[ω, ν]` that ends the iteration.
    pub converged_step: f64,
    /// Observations needed: twice the minimum of three.
    pub least_observations: usize,
    /// Floor of the pixel noise in the covariance \[px\]: few points can fit perfectly.
    pub least_sigma_px: f64,
}

impl Default for PoseOnlyOptions {
    fn default() -> Self {
        Self {
            max_iterations: 15,
            kernel_px: 1.0,
            inlier_px: 2.5,
            initial_kernel_ratio: 16.0,
            kernel_decay: 0.4,
            converged_step: 1e-7,
            least_observations: 6,
            least_sigma_px: 0.1,
        }
    }
}

/// Limits of the bundle adjustment.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BundleOptions {
    /// Iterations at most.
    pub max_iterations: usize,
    /// Scale of the Cauchy kernel \[px\]: the noise of a tracked corner.
    pub kernel_px: f64,
    /// Ends when the cost falls by less than this fraction.
    pub relative_decrease: f64,
    /// First damping, relative to the diagonal.
    pub initial_damping: f64,
    /// Factor on the damping after a rejected step.
    pub damping_increase: f64,
    /// Factor on the damping after an accepted step.
    pub damping_decrease: f64,
    /// Least damping.
    pub least_damping: f64,
    /// Damping above which the solver gives up.
    pub most_damping: f64,
    /// Reprojection error of a point behind the camera \[px\]: a far outlier.
    pub behind_px: f64,
    /// Noise of a tracked corner \[px\]; converts whitened road residuals to px².
    pub pixel_sigma_px: f64,
    /// Cauchy scale of whitened baseline lengths: a speed bump or a false plane loses weight.
    pub length_kernel: f64,
    /// Cauchy scale of whitened heights of road points: objects on the road lose weight.
    pub road_point_kernel: f64,
}

impl Default for BundleOptions {
    fn default() -> Self {
        Self {
            max_iterations: 8,
            kernel_px: 1.0,
            relative_decrease: 1e-4,
            initial_damping: 1e-4,
            damping_increase: 10.0,
            damping_decrease: 0.2,
            least_damping: 1e-9,
            most_damping: 1e6,
            behind_px: 100.0,
            pixel_sigma_px: 0.5,
            length_kernel: 2.0,
            road_point_kernel: 2.0,
        }
    }
}

/// Size of the local map.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WindowOptions {
    /// Keyframes optimised together. More cost time and reduce drift.
    pub free_keyframes: usize,
    /// Older keyframes that stay fixed and hold position, orientation and scale.
    pub fixed_keyframes: usize,
    /// Least angle between two observations of a new point \[rad\]. 0.5°: depth is then known to about 10 % at 0.5 px.
    pub least_parallax_rad: f64,
    /// Observations with a larger reprojection error are dropped after the adjustment \[px\].
    pub outlier_px: f64,
    /// True adds soft baseline lengths from the road to the adjustment.
    pub road_scale: bool,
    /// True adds soft constraints of landmarks to the road plane.
    pub road_plane: bool,
    /// Bundle adjustment.
    pub bundle: BundleOptions,
    /// Half width of the stretch of road whose points are constrained \[camera heights\]: the own lane without kerbs.
    pub road_half_width_heights: f64,
    /// Nearest road point used \[camera heights\].
    pub road_near_heights: f64,
    /// Farthest road point used \[camera heights\].
    pub road_far_heights: f64,
    /// Height above or below the plane up to which a point may belong to the road \[camera heights\]: 20 cm for a car.
    pub road_gate_heights: f64,
    /// Unevenness of the road \[camera heights\]: 3 cm for a car.
    pub road_unevenness_heights: f64,
    /// Standard deviation of a plane's height \[camera heights\]: the body heaves by 3 cm.
    pub plane_height_sigma: f64,
    /// Standard deviation of a plane's tilt \[rad\]: 0.3°.
    pub plane_tilt_sigma_rad: f64,
    /// Nearest landmarks whose median depth starts the tracking of a corner without a position, at most 16. More resist outliers and
    /// reach farther away; only the start of tracking depends on it.
    pub depth_neighbours: usize,
    /// Weight of vertical against horizontal pixel distances among them: on a road depth changes from row to row.
    pub depth_row_weight: f64,
}

impl Default for WindowOptions {
    fn default() -> Self {
        Self {
            free_keyframes: 10,
            fixed_keyframes: 3,
            least_parallax_rad: 0.5_f64.to_radians(),
            outlier_px: 3.0,
            road_scale: true,
            road_plane: true,
            bundle: BundleOptions::default(),
            road_half_width_heights: 1.2,
            road_near_heights: 1.0,
            road_far_heights: 15.0,
            road_gate_heights: 0.12,
            road_unevenness_heights: 0.02,
            plane_height_sigma: 0.02,
            plane_tilt_sigma_rad: 0.005,
            depth_neighbours: 5,
            depth_row_weight: 4.0,
        }
    }
}

/// Largest `depth_neighbours`: they are kept on the stack.
pub(crate) const MOST_NEIGHBOURS: usize = 16;
