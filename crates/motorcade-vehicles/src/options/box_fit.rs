//! Options of the fit of a vehicle to one image box.

/// Edge noise, occlusion tests and road height of the fit to one box.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BoxFitOptions {
    /// Distance from the image border below which an edge counts as truncated, in pixels of the detector's input. Detectors stop one to two of
    /// them short of the border, and jitter; a larger value discards true edges.
    pub border_px: f64,
    /// Share of an edge that a nearer box must cover for the edge to count as occluded. Rendered drives give 0.25, 0.4
    /// and 0.6 hardly apart (BENCHMARK.md, "Constants over scenarios and seeds"); a larger value takes cut boxes for whole ones.
    pub occluded_share: f64,
    /// Standard deviation of an edge, constant part, in pixels of the detector's input: its jitter. 1.0 to 1.9 px with our network
    /// on rendered drives, boxes of 8 to 60 px.
    pub edge_sigma_px: f64,
    /// Standard deviation of an edge as a share of the box's side: mirrors, shadows and the detector's habits. Unoccluded cars of KITTI
    /// 0003 and 0005: 2.7 to 4.6 % with YOLOX-Nano, 2.9 to 6.1 % with our network (68 %, without the bias between labels and boxes).
    pub edge_sigma_share: f64,
    /// The same for left, top and right of vans, lorries and buses, with superstructures, mirrors and trailers: 5 to 7 % aside
    /// and 9 to 17 % at the top on 0005, with either network. Their lower edge errs as little as that of cars.
    pub large_edge_sigma_share: f64,
    /// Standard deviation of the error that the heights of all boxes of a track share, in pixels of the detector's input: frames do not average it. By
    /// tracks of rendered and labelled cars between 30 and 90 m, boxes of 15 to 35 px of the picture, 1.4 to 3.3 px of the picture with our network, whose
    /// input has 1.5 of them (BENCHMARK, "Far vehicles"). Larger ones make far vehicles less certain.
    pub common_height_sigma_px: f64,
    /// Factor on the standard deviation of truncated and occluded edges, which are one-sided constraints.
    pub one_sided_factor: f64,
    /// Standard deviation of the part of a vehicle below an occluded bottom edge, as a share of the visible height. It bounds the
    /// depth of a vehicle whose roof is as high as the camera.
    pub occluded_extent_share: f64,
    /// Standard deviation of top and bottom of a car truncated at the side, as a share of the visible height: a bonnet is
    /// lower than the roof.
    pub truncated_part_share: f64,
    /// Change of the road's slope over `road_slope_length_m`, one standard deviation \[rad\]: vertical curves of streets, 0.2°.
    pub road_slope_sigma_rad: f64,
    /// Length over which the slope changes by `road_slope_sigma_rad` \[m\].
    pub road_slope_length_m: f64,
    /// Largest number of such lengths; beyond, the slope's standard deviation is constant.
    pub road_slope_most_lengths: f64,
    /// Way over which the curvature of a road is forgotten to 1/e \[m\], one and a half of those lengths. Chosen.
    pub road_curvature_length_m: f64,
    /// Standard deviation of the height of the camera's own way over the plane of a frame \[m\]: heave of the body. Measured against ground truth: 0.002 to
    /// 0.02 m on rendered drives, 0.03 m on 0005.
    pub way_height_sigma_m: f64,
    /// The same as a share of the distance \[rad\], by the odometry's direction. Measured: less than 0.001.
    pub way_slope_sigma_rad: f64,
    /// The same as a share of the height: on a hill the odometry's scale errs. Chosen: rendered crests have 3 to 6 %.
    pub way_scale_sigma: f64,
    /// Distance beside the own lane at which the way tells of the road's height no more than 1/e of what it does there \[m\]. Chosen: parking lanes and
    /// footpaths lie within, yards beyond.
    pub way_reach_m: f64,
    /// Deviation of the way from what the road before it foretells, in standard deviations, from which on it is another road. Chosen.
    pub way_gate_sigmas: f64,
    /// Standard deviation of the road's height at the camera \[m\]: texture and crown.
    pub road_height_sigma_m: f64,
    /// Cross-fall of streets, kerbs and medians beside the own lane, one standard deviation \[rad\]: 2.5 %, the slope that roads are
    /// drained by.
    pub cross_fall_sigma_rad: f64,
    /// Largest standard deviation of the road's height by cross-fall, kerbs and medians \[m\]: parallel roads lie higher or lower.
    pub cross_fall_most_m: f64,
    /// Half width of the lane under the camera, whose plane is measured, and within which of the camera's path a vehicle is ahead (`speeds.csv`) \[m\]. Less takes
    /// own-lane vehicles for ones aside: 1.2 finds fewer cars of rendered drives at 5, 10 and 20 frames/s; 2.7 as many, but their roads have no cross-fall.
    pub own_lane_half_width_m: f64,
    /// Scale of the Cauchy kernel on whitened edge residuals: a larger value follows boxes that jump.
    pub cauchy_scale: f64,
    /// Gauss–Newton steps at most.
    pub iterations: usize,
    /// Largest change of the distance in one step, as a share of it: far away the problem is almost flat in depth.
    pub step_share: f64,
    /// χ² at which the edges of one box saturate: a box that nothing explains counts no more.
    pub saturation_chi2: f64,
    /// Smallest distance ahead at which a fit is a vehicle \[m\]: a camera in a car sees none nearer. Chosen.
    pub nearest_m: f64,
    /// Smallest distance ahead that a fit starts from \[m\]: nearer ones are almost beside the camera, where the problem is far from linear. Chosen.
    pub nearest_start_m: f64,
    /// Depths between which a fit starts \[m\]; what is nearer than `nearest_start_m` starts from there. Chosen: wider ones take more steps and fail more often.
    pub start_depths_m: [f64; 2],
    /// Depth of the road at the bottom edge beyond which the edge is too close to the horizon to start from \[m\]. Chosen: pitch moves a farther one by its
    /// own length.
    pub horizon_m: f64,
    /// Distance of the rear tyres, to which the bottom edge belongs, behind the centre of a vehicle as a share of its length, where a fit starts.
    pub rear_tyres_share: f64,
}

impl BoxFitOptions {
    /// Lengths over which the road's slope changes up to a place ahead, as many as count.
    pub(crate) fn slope_lengths(&self, ahead_m: f64) -> f64 {
        (ahead_m / self.road_slope_length_m).min(self.road_slope_most_lengths)
    }

    /// Distance of a place to the side of the own lane \[m\].
    pub fn beside_m(&self, left_m: f64) -> f64 {
        (left_m.abs() - self.own_lane_half_width_m).max(0.0)
    }

    /// Standard deviation of the road's level at a place beside the own lane \[m\].
    pub fn level_sigma_m(&self, left_m: f64) -> f64 {
        (self.cross_fall_sigma_rad * self.beside_m(left_m)).min(self.cross_fall_most_m)
    }
}

impl Default for BoxFitOptions {
    fn default() -> Self {
        Self {
            border_px: 3.0,
            occluded_share: 0.4,
            edge_sigma_px: 1.4,
            edge_sigma_share: 0.035,
            large_edge_sigma_share: 0.07,
            common_height_sigma_px: 1.2,
            one_sided_factor: 3.0,
            occluded_extent_share: 0.3,
            truncated_part_share: 0.15,
            road_slope_sigma_rad: 0.2_f64.to_radians(),
            road_slope_length_m: 20.0,
            road_slope_most_lengths: 3.0,
            road_curvature_length_m: 30.0,
            way_height_sigma_m: 0.03,
            way_slope_sigma_rad: 0.001,
            way_scale_sigma: 0.05,
            way_reach_m: 8.0,
            way_gate_sigmas: 5.0,
            road_height_sigma_m: 0.02,
            cross_fall_sigma_rad: 0.025,
            cross_fall_most_m: 0.8,
            own_lane_half_width_m: 1.8,
            cauchy_scale: 3.0,
            iterations: 12,
            step_share: 0.33,
            saturation_chi2: 30.0,
            nearest_m: 1.0,
            nearest_start_m: 3.0,
            start_depths_m: [2.0, 250.0],
            horizon_m: 200.0,
            rear_tyres_share: 0.25,
        }
    }
}
