//! Options of views that come from keypoints or from vehicle poses of a file.

use motorcade_shape::FitOptions;

/// Views of a vehicle from its keypoints.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct KeypointViewOptions {
    /// False takes no position, heading or size from keypoints. What they say on boxes that show no vehicle still counts.
    pub enabled: bool,
    /// Overlap (IoU) of the keypoints' bounding box with a detected box from which they belong to it.
    pub least_iou: f64,
    /// Standard deviation of a keypoint as a share of the longer side of the box: 2 px of a 64 px heat map.
    pub sigma_share: f64,
    /// Factor on the variance of a view, besides `correlation_time_s`: a network misplaces a point as in the frame before, and
    /// errors of several points of a vehicle are correlated.
    pub variance_factor: f64,
    /// Frames, spread over the track, whose common shape is fitted.
    pub shape_frames: usize,
    /// Frames below which no common shape is fitted.
    pub least_shape_frames: usize,
    /// Angle between two directions of view up to which a network misplaces the points of a vehicle alike \[rad\]: frames in such views
    /// add little about the shape. A car followed for 30 s shows its rear alone, whose height and width would otherwise decide its length.
    pub similar_views_rad: f64,
    /// Frames before the window of an online run of which keypoints are kept, spread over the track, for its shape: four times
    /// `shape_frames`. More keep what earlier views showed of the shape for longer and need more memory.
    pub most_earlier_frames: usize,
    /// Smallest standard deviation of a dimension of the common shape \[m\].
    pub least_size_sigma_m: f64,
    /// Smallest standard deviation of a heading \[rad\].
    pub least_heading_sigma_rad: f64,
    /// Cost \[χ²\] of a vehicle that turns by more than a right angle between two views, −2 ln of 0.1 %: only a network that errs does
    /// that. A larger one holds the heading of a track together, and turns all of it if most views err. Chosen, not measured.
    pub turn_cost: f64,
    /// Most that one view says on the front of a vehicle \[χ²\], −2 ln of 1 %: errors of a network repeat from frame to frame. A larger one lets
    /// single certain views outvote many doubtful ones. Chosen, not measured.
    pub most_heading_margin: f64,
    /// Standard deviation of the road's height under the camera \[m\]: heave of the body and unevenness, 3 cm for a car. Chosen: a larger one takes the
    /// distance more from the size.
    pub road_height_sigma_m: f64,
    /// Standard deviation of the road's slope between camera and vehicle, besides the pitch of the frame \[rad\].
    pub road_slope_sigma_rad: f64,
    /// Fit of the shape prior.
    pub fit: FitOptions,
}

impl Default for KeypointViewOptions {
    fn default() -> Self {
        Self {
            enabled: true,
            least_iou: 0.4,
            sigma_share: 0.03,
            variance_factor: 2.0,
            shape_frames: 12,
            least_shape_frames: 3,
            similar_views_rad: 0.05,
            most_earlier_frames: 48,
            least_size_sigma_m: 0.02,
            least_heading_sigma_rad: 0.05,
            turn_cost: 14.0,
            most_heading_margin: 9.2,
            road_height_sigma_m: 0.03,
            road_slope_sigma_rad: 0.0035,
            fit: FitOptions::default(),
        }
    }
}

/// Views of a vehicle from poses of a file. Published single-view front ends err by 5 to 8 % of depth within 30 m, most of it common
/// to all frames of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ExternalViewOptions {
    /// Relative depth error common to all frames of a vehicle, one standard deviation.
    pub common_depth_share: f64,
    /// Relative depth error of a single frame, one standard deviation.
    pub own_depth_share: f64,
    /// Constant part of the error along the ray, one standard deviation \[m\].
    pub depth_sigma_m: f64,
    /// Error across the ray as a share of the distance, one standard deviation.
    pub lateral_share: f64,
    /// Constant part of the error across the ray, one standard deviation \[m\].
    pub lateral_sigma_m: f64,
    /// Standard deviation of a heading \[rad\]: 5 to 10° from frame to frame.
    pub heading_sigma_rad: f64,
}

impl Default for ExternalViewOptions {
    fn default() -> Self {
        Self {
            common_depth_share: 0.06,
            own_depth_share: 0.053,
            depth_sigma_m: 0.3,
            lateral_share: 0.01,
            lateral_sigma_m: 0.1,
            heading_sigma_rad: 0.15,
        }
    }
}
