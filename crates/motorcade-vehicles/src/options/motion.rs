//! Options of the motion model and of the decision between moving and static.

/// Continuous-time white-noise-acceleration model of a vehicle's position and velocity.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionOptions {
    /// Spectral density of the acceleration along the road \[m/s² per √Hz\]: gentle braking and bends. A smaller value smooths
    /// more and lags in braking.
    pub acceleration_density: f64,
    /// Spectral density of the acceleration across the road plane \[m/s² per √Hz\]: undulation of the road.
    pub vertical_density: f64,
    /// Standard deviation of a velocity before it is measured \[m/s\]: traffic.
    pub initial_speed_sigma_mps: f64,
    /// Factor on the covariance of the first position of a smoothed track, which is used twice.
    pub initial_position_factor: f64,
    /// Mahalanobis distance beyond which a position loses weight \[χ²₃\]: 95 % quantile.
    pub gate_chi2: f64,
    /// Largest speed of a vehicle while it is tracked \[m/s\].
    pub largest_speed_mps: f64,
    /// Positions of a static vehicle count as at most this many independent ones: errors of size and plane are common.
    pub static_independent_views: f64,
    /// Variance of each component of a static vehicle's velocity \[m²/s²\].
    pub static_velocity_variance: f64,
}

impl Default for MotionOptions {
    fn default() -> Self {
        Self {
            acceleration_density: 1.2,
            vertical_density: 0.3,
            initial_speed_sigma_mps: 15.0,
            initial_position_factor: 4.0,
            gate_chi2: 7.8,
            largest_speed_mps: 60.0,
            static_independent_views: 4.0,
            static_velocity_variance: 0.05,
        }
    }
}

/// Moving or static: mean velocity against the apparent velocity that depth errors cause.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct KinematicStateOptions {
    /// Shortest observation that is decided \[s\]; P(moving) of shorter ones is 0.5.
    pub shortest_s: f64,
    /// Relative depth error common to all positions of a track: size and slope of the road. A larger one calls fewer
    /// standing vehicles moving and more slow ones standing. Rendered drives would have 0.08, the labelled tracks of KITTI 0005, 0001 and 0007 not
    /// (BENCHMARK, Constants over scenarios and seeds).
    pub common_depth_share: f64,
    /// Error of a vehicle's centre against the side of it that is seen, common to all positions of a track \[m\]: between half a width and half a
    /// length. It moves across the line of sight while that turns; a larger one calls fewer parked cars beside the road moving, and crossing ones later.
    pub common_centre_m: f64,
    /// Speed below which motion is not observable \[m/s\].
    pub speed_floor_mps: f64,
    /// Positions count as at most this many independent ones in the noise of the mean velocity.
    pub independent_views: f64,
    /// Factor on the standard deviation of the mean velocity by the positions' own: below 1, because they hold what is common to all positions
    /// as well. A larger one calls fewer standing vehicles moving and more slow ones standing, as `even_odds_sigmas` does.
    pub noise_factor: f64,
    /// Weight of the covariances of single positions against their scatter about a line, in degrees of freedom. A larger one decides later where
    /// the covariances hold what is common to all positions. Rendered drives, online, prefer 1 and 2 to 4; labelled tracks do not decide.
    pub noise_dof: f64,
    /// Degrees of freedom of Student's t distribution by which positions are weighted in the line through them. Chosen, not measured: fewer trust
    /// the middle of the residuals more; above 2 the distribution has a variance.
    pub line_dof: f64,
    /// Least scale of the squared residuals about that line against the variances of the positions, most of which is common to all of them. Chosen,
    /// not measured: a smaller one distrusts positions near the line.
    pub line_least_scale: f64,
    /// Rounds of reweighting of that line. Chosen, not measured: more resist more outliers and take longer.
    pub line_rounds: usize,
    /// Share of a speed that counts where it points backwards: few vehicles reverse.
    pub backward_share: f64,
    /// Share of headings that are the wrong way round: a vehicle that is fast backwards has such a one. Of our network's 4.1 % are (BENCHMARK).
    pub reversed_share: f64,
    /// Ratio of speed to its standard deviation at which P(moving) is 0.5. A larger one calls fewer standing vehicles moving and more slow ones
    /// standing. Rendered drives would have 4.5, the labelled tracks of KITTI 0005, 0001 and 0007 have 3 (BENCHMARK, Constants over scenarios and
    /// seeds).
    pub even_odds_sigmas: f64,
    /// Slope of the logistic function in that ratio. A steeper one has more confidence in right and in wrong decisions; 1.3 and 3 are both
    /// a little worse on rendered drives (BENCHMARK, Constants over scenarios and seeds).
    pub logistic_slope: f64,
    /// P(moving) above which the headings of a vehicle follow its travel and its states move; at or below it stands. At 0.5 either error costs
    /// the same; a larger one lets more slow vehicles stand. Outputs and drawings tell moving from standing at 0.5 whatever this is.
    pub moving_from: f64,
    /// P(moving) from which on, and up to 1 less this, an estimate over the last seconds is the mean of the states of both hypotheses and is no part of the
    /// graph; at 0.5 none is. All others, and those of a drive as a whole, are the more probable one, with the other one in their covariance. Above
    /// `off_road_factor`, which is P(moving) of what surely stands beside the road. A smaller one makes
    /// errors of wrong decisions smaller and those of right ones larger: rendered oncoming traffic at 25 frames/s, 0.25, 0.15 and 0.1: 0.82, 0.70
    /// and 0.66 m, 1.77 m without; at 0.1 crossing traffic gets worse (1.6 -> 4.7 m).
    pub undecided_from: f64,
    /// Mean probability of road below the boxes of a track under which it is beside the road. Of the vehicles of 0005 and 0003 that drive it
    /// is 0.88 and more, of those parked beside the road 0.58 and less.
    pub least_road_below: f64,
    /// Boxes with a known probability of road below them from which on they show a vehicle beside the road; at least 1. Chosen, not measured: more
    /// are less deceived by single masks and leave out short tracks.
    pub least_road_boxes: usize,
    /// Factor on P(moving) of a track beside the road that appears to drive ahead, as the camera does. On 0005 and 0003 none of six such
    /// tracks drives (rule of succession: 1/8).
    pub off_road_factor: f64,
}

impl KinematicStateOptions {
    /// True where both hypotheses are probable.
    pub fn is_undecided(&self, p_moving: f64) -> bool {
        p_moving > self.undecided_from && p_moving < 1.0 - self.undecided_from
    }
}

impl Default for KinematicStateOptions {
    fn default() -> Self {
        Self {
            shortest_s: 0.25,
            common_depth_share: 0.05,
            common_centre_m: 1.6,
            speed_floor_mps: 0.3,
            independent_views: 4.0,
            noise_factor: 0.87,
            noise_dof: 2.0,
            line_dof: 4.0,
            line_least_scale: 0.05,
            line_rounds: 5,
            backward_share: 0.5,
            reversed_share: 0.05,
            even_odds_sigmas: 3.0,
            logistic_slope: 2.0,
            moving_from: 0.5,
            undecided_from: 0.15,
            least_road_below: 0.6,
            least_road_boxes: 3,
            off_road_factor: 0.125,
        }
    }
}
