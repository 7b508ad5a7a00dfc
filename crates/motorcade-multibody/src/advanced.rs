//! Settings of the multi-object graph that rarely need to change.

use serde::{Deserialize, Serialize};

use crate::kernel::GraphKernel;

/// Settings of the multi-object graph that rarely need to change: unit, source and trade-off of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedGraphOptions {
    /// Depth up to which camera–vehicle edges are the trusted ones \[m\] (the paper's 45 m).
    pub near_limit_m: f64,
    /// Robust kernel of camera–vehicle edges.
    pub kernel: GraphKernel,
    /// Its scale \[standard deviations, as inflated by the correlation time at 10 frames/s\]: boxes have heavy-tailed errors.
    pub kernel_scale: f64,
    /// One variable for the scale of a vehicle's size, shared by its camera–vehicle edges; false puts the size's
    /// uncertainty into the covariance of each edge.
    pub shared_size: bool,
    /// Rounds in which the covariances of each class of camera–vehicle edges are re-estimated from residuals; 0 leaves
    /// them. Not used online, where windows are too short, nor with constant weights.
    pub variance_rounds: usize,
    /// Tracks start at the medoid of their camera–vehicle measurements; false starts them at the front end's poses.
    pub medoid_start: bool,
    /// Most iterations of a solve.
    pub max_iterations: usize,
    /// P(moving) below which a vehicle is static: one landmark node seen from many cameras. Half: the more probable
    /// hypothesis. Higher makes slow vehicles static, lower makes parked ones drift.
    pub static_below_p_moving: f64,
    /// Distance of the rear axle behind the middle of a vehicle, as a share of its length: cars, vans, lorries and buses
    /// lie between 0.27 and 0.33.
    pub rear_axle_share: f64,
    /// Standard deviation of the camera's log scale above which a step counts as guessed, not metric. A measured scale has
    /// 0.01 to 0.1, a guessed one 0.3 and more.
    pub guessed_scale_sigma: f64,
    /// Variance of single poses over that of a trajectory's growth from frame to frame: consecutive poses are estimated against
    /// the same landmarks, so the errors of consecutive steps are anti-correlated, and the variance of a trajectory is the sum
    /// of its steps' divided by 1 + this (ten rendered drives of 30 to 119 frames, rotation and sideways). The covariance of a
    /// step grows with its interval, so this holds at any frame rate. Larger: odometry is trusted more against vehicles.
    pub step_anticorrelation: f64,
    /// Rotation allowed to a step of the camera that is held \[rad\]: 0.1 mrad over a hundred steps.
    pub held_rad: f64,
    /// Translation allowed to a step of the camera that is held \[m\]: 1 mm over a hundred steps.
    pub held_m: f64,
    /// Interval at which the standard deviations of the motion model below are stated \[s\].
    pub reference_interval_s: f64,
    /// Steady motion: change of roll, pitch and yaw per interval, from one interval to the next \[rad\]. White-noise
    /// acceleration, so it grows with the interval to the power 3/2. 0.004 rad of yaw is a change of the yaw rate by 0.04 rad/s
    /// in a tenth of a second. Smaller values smooth more and lag in turns.
    pub steady_motion_rad: [f64; 3],
    /// Steady motion: change of the displacement forward, sideways and up per interval \[m\]. Traffic brakes and speeds up with about
    /// 1 m/s² (σ) for about 3 s (τ), which over longer times is white noise of density q = √(2 σ² τ) = 2.45 m/s² per √Hz (Singer,
    /// IEEE Trans. AES, 1970), and that changes the displacement of an interval by √(2/3) q Δt^1.5 = 0.063 m forward. Smaller values
    /// smooth more and lag behind vehicles that brake. 0.01 m sideways is an acceleration of 1 m/s² for a tenth of a second.
    pub steady_motion_m: [f64; 3],
    /// No side slip: roll and pitch per interval \[rad\]. White-noise velocity: grows with the square root of the interval.
    pub roll_pitch_slip_rad: f64,
    /// No side slip: sideways motion of the rear axle per interval \[m\].
    pub sideways_slip_m: f64,
    /// Standard deviation of the sideways motion of a vehicle slower than `slow_mps`, whose heading its motion does not show \[m\].
    pub slow_sideways_slip_m: f64,
    /// No side slip: motion up per interval \[m\].
    pub vertical_slip_m: f64,
    /// Speed below which a vehicle counts as slow \[m/s\].
    pub slow_mps: f64,
    /// Rotation of the weak tie of a vehicle pose to its start \[rad\], which keeps every node determined. The ties of a hundred poses, which the motion
    /// model joins, are ten times as strong as one.
    pub tie_rad: f64,
    /// Translation of the weak tie of a vehicle pose to its start \[m\]. Smaller ones count as knowledge: of 30 poses, 10 m each are one of 1.8 m, and cars
    /// that were always 60 m away had 1.3 m of deviation at 10 m of error.
    pub tie_m: f64,
    /// Least standard deviation of a vehicle's log size: outlines are those of a drawing.
    pub least_scale_sigma: f64,
    /// Time for which errors of depth that look like a scale are correlated \[s\]: plane, slope, habit of the detector. The prior of
    /// the scale counts more by this time over `graph.correlation_time_s`.
    pub scale_correlation_time_s: f64,
    /// Online: a vehicle whose heading the front end turns by more was reversed and starts anew \[rad\].
    pub flipped_rad: f64,
    /// Degrees of freedom a class of edges needs for its covariances to be re-estimated: 30 give the factor to a quarter of itself
    /// (√(2/30)).
    pub least_degrees_of_freedom: f64,
    /// Largest factor on the variances of a class; beyond, the model is wrong rather than the noise.
    pub most_variance_factor: f64,
    /// Squared distance at which a vote for the start of a track is truncated: χ² of 4 degrees of freedom (position, heading) at
    /// 99 %.
    pub start_truncation: f64,
    /// Most candidates for the start of a track, spread over it: their number enters squared.
    pub start_candidates: usize,
    /// Way driven beyond which the direction of travel decides which end of a vehicle is its front \[m\].
    pub start_least_way_m: f64,
}

impl Default for AdvancedGraphOptions {
    fn default() -> Self {
        Self {
            near_limit_m: 45.0,
            kernel: GraphKernel::Cauchy,
            kernel_scale: 1.0,
            shared_size: true,
            variance_rounds: 3,
            medoid_start: true,
            max_iterations: 100,
            static_below_p_moving: 0.5,
            rear_axle_share: 0.3,
            guessed_scale_sigma: 0.2,
            step_anticorrelation: 4.0,
            held_rad: 1e-5,
            held_m: 1e-4,
            reference_interval_s: 0.1,
            steady_motion_rad: [0.01, 0.01, 0.004],
            steady_motion_m: [0.063, 0.01, 0.01],
            roll_pitch_slip_rad: 0.01,
            sideways_slip_m: 0.02,
            slow_sideways_slip_m: 0.05,
            vertical_slip_m: 0.03,
            slow_mps: 1.0,
            tie_rad: 10.0,
            tie_m: 100.0,
            least_scale_sigma: 0.005,
            scale_correlation_time_s: 2.0,
            flipped_rad: 1.0,
            least_degrees_of_freedom: 30.0,
            most_variance_factor: 16.0,
            start_truncation: 13.3,
            start_candidates: 48,
            start_least_way_m: 3.0,
        }
    }
}
