//! Options of corner detection and tracking.

/// Region and density of corner detection.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CornerOptions {
    /// Grid columns across the image; cells are square, at least 16 px. More columns give more landmarks and cost time.
    pub columns: usize,
    /// Corners a cell should hold, including those already tracked.
    pub per_cell: usize,
    /// Least distance between corners \[px\].
    pub distance_px: f64,
    /// Least smaller eigenvalue of the structure tensor, mean over the window \[(grey levels/px)²\]: above sensor noise.
    pub least_eigenvalue: f32,
    /// Corners nearer to the border are not used \[px\].
    pub border_px: usize,
}

impl Default for CornerOptions {
    fn default() -> Self {
        Self { columns: 31, per_cell: 2, distance_px: 10.0, least_eigenvalue: 8.0, border_px: 12 }
    }
}

/// Limits of the tracker.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct KltOptions {
    /// Iterations on each level.
    pub max_iterations: usize,
    /// Settings that rarely need a change.
    pub advanced: AdvancedKltOptions,
}

impl Default for KltOptions {
    fn default() -> Self {
        Self { max_iterations: 12, advanced: AdvancedKltOptions::default() }
    }
}

/// Acceptance of a patch, pyramid levels, the use of predictions, contrast, and the border of boxes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedKltOptions {
    /// Steps shorter than this end the iteration \[px\].
    pub epsilon_px: f32,
    /// Largest root-mean-square grey difference of an accepted patch, after removing the mean \[grey levels\].
    pub max_rms: f32,
    /// Least smaller eigenvalue of the template's structure tensor, mean over the patch \[(grey levels/px)²\].
    pub least_eigenvalue: f32,
    /// Largest forward–backward distance \[px\].
    pub max_return_px: f64,
    /// Levels of the image pyramid.
    pub pyramid_levels: usize,
    /// Coarsest level for landmarks with a position, whose prediction is good to a few pixels.
    pub landmark_level: usize,
    /// Coarsest level for corners without a position.
    pub corner_level: usize,
    /// Error of the prediction below which the backward check starts at `near_return_level` \[px\]: a quarter of the patch,
    /// its basin of convergence.
    pub near_return_px: f64,
    /// Coarsest level of the backward check after a good prediction.
    pub near_return_level: usize,
    /// Coarsest level of the backward check otherwise.
    pub far_return_level: usize,
    /// Age from which templates are renewed \[s\]: every frame up to ten frames/s. Longer: less drift at high frame rates, but
    /// a larger change of the patches.
    pub template_s: f64,
    /// Median image motion from which templates are renewed earlier \[px\]: a fifth of a patch.
    pub template_motion_px: f64,
    /// Limits of the predicted growth of a patch between two frames: beyond, the depth is wrong.
    pub growth: [f64; 2],
    /// Predicted motion above which the landmark's position is not believed \[image widths\].
    pub longest_motion: f64,
    /// Factor between the contrasts of two images below which they are compared as they are: the contrast of a scene changes by as much from frame
    /// to frame. Chosen; exposure that halves and doubles is followed (BENCHMARK, Broken input). A smaller one corrects changes of the scene
    /// too, a larger one leaves jumps to `max_rms`.
    pub same_gain: f32,
    /// Factor between the contrasts from which one of the images shows another scene or none, and is not corrected. Chosen: eight times
    /// is three stops of exposure; a larger one amplifies the noise of plain images.
    pub most_gain: f32,
    /// Width of the border around the box of a vehicle in which a corner mixes background and vehicle \[px\]: a quarter of the patch. Chosen, not
    /// measured: a wider one keeps out more corners of vehicles, and of the scene beside them.
    pub box_rim_px: f64,
}

impl Default for AdvancedKltOptions {
    fn default() -> Self {
        Self {
            epsilon_px: 0.01,
            max_rms: 18.0,
            least_eigenvalue: 3.0,
            max_return_px: 0.7,
            pyramid_levels: 4,
            landmark_level: 2,
            corner_level: 3,
            near_return_px: 4.0,
            near_return_level: 1,
            far_return_level: 3,
            template_s: 0.095,
            template_motion_px: 3.0,
            growth: [0.5, 2.0],
            longest_motion: 0.25,
            same_gain: 1.15,
            most_gain: 8.0,
            box_rim_px: 4.0,
        }
    }
}
