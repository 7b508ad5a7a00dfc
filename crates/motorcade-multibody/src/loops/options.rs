//! Settings of loop closing.

use serde::{Deserialize, Serialize};

/// Settings of loop closing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LoopOptions {
    /// False looks for no places seen again. Drives are then as odometry and road give them.
    pub enabled: bool,
    /// Way between keyframes of places \[camera heights\]: 2 are 3.3 m under a car's camera. Shorter finds places a little more often;
    /// memory and time grow in proportion.
    pub spacing_heights: f64,
    /// Keyframes, gates, weights, and agreement of edges with the odometry and with each other.
    pub advanced: AdvancedLoopOptions,
}

/// Keyframes, gates, weights, and agreement of edges with the odometry and with each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedLoopOptions {
    /// Rotation after which a keyframe is taken all the same \[rad\].
    pub spacing_rad: f64,
    /// Time between keyframes where the camera's height in units of the odometry is not known yet \[s\].
    pub spacing_s: f64,
    /// Time from the first keyframe of a map \[s\] in which keyframes are `young_share` times as far apart. A longer one finds more places from the start of a
    /// map on, and costs more keyframes.
    pub young_s: f64,
    /// Factor on the spacing of keyframes of a map that has just begun: three have to agree before two maps are joined. A smaller one joins maps
    /// earlier, on views that differ less.
    pub young_share: f64,
    /// Distance between where odometry and where the place says the camera is, beyond which they are two places \[m\]. Not across a
    /// break, where odometry does not know.
    pub gate_m: f64,
    /// More of it for each metre driven between the visits: five times the drift of the odometry. Larger closes loops after more drift and
    /// joins places that look alike from farther apart.
    pub gate_share: f64,
    /// Scale of the Geman–McClure kernel of the edges \[standard deviations\]: χ² of 6 degrees of freedom at 95 %.
    pub kernel_scale: f64,
    /// Weight below which an edge was switched off by the others and counts as no loop.
    pub least_weight: f64,
    /// Factor on the covariances of edges: neighbouring keyframes see the same landmarks.
    pub correlation: f64,
    /// Least standard deviation of an edge's orientation \[rad\]: pitch and rolling shutter of both visits.
    pub least_sigma_rad: f64,
    /// Least standard deviation of an edge's position \[m\]: the scale of the earlier visit at a landmark's distance.
    pub least_sigma_m: f64,
    /// Factor on the covariance of a step across a break, which no odometry measured: the car may have turned.
    pub break_inflation: f64,
    /// Largest factor on the covariance of the odometry, which grows as far as that makes steps and edges more probable: a bias of
    /// heading adds up to more than independent errors of steps. Larger closes loops after more drift.
    pub most_odometry_factor: f64,
    /// Longest correlation of errors of scale \[s\]. Chosen, not measured: a larger one lets loops change the scale more.
    pub most_correlated_s: f64,
    /// Share of the edges that must agree with the corrected trajectory before single ones are switched off. Chosen, not measured: a larger one trusts the
    /// odometry less where single edges are false, a smaller one leaves true edges out.
    pub agreeing_share: f64,
    /// χ² up to which the edge at that share agrees: the quantile of χ²₆ at `agreeing_share`, with which it is to be changed.
    pub agreeing_chi2: f64,
    /// Least growth of the covariance of the odometry from solution to solution, at least 1.1. A smaller one finds the factor more exactly and
    /// costs more solutions.
    pub least_growth: f64,
    /// The most probable factor is looked for up to the best one so far times this. A larger one finds biases of an odometry that is far too certain,
    /// and costs more solutions.
    pub beyond_best: f64,
    /// Distance between where an edge puts a camera and where a start of a map has it, beyond which the edge speaks no more against that start
    /// \[m\]. Chosen, not measured: a larger one gives false edges more weight, a smaller one takes true edges for false in a map that drifts.
    pub elsewhere_m: f64,
    /// Time between keyframes of a map that is joined with another one \[s\], by which the uncertainty of their steps is estimated: 3.3 m at 10 m/s.
    /// Chosen, not measured: maps do not hold the times of their keyframes. A longer one lets the second map bend more.
    pub map_step_s: f64,
}

impl Default for AdvancedLoopOptions {
    fn default() -> Self {
        Self {
            spacing_rad: 0.15,
            spacing_s: 0.4,
            young_s: 1.0,
            young_share: 0.2,
            gate_m: 3.0,
            gate_share: 0.05,
            kernel_scale: 3.55,
            least_weight: 0.25,
            correlation: 4.0,
            least_sigma_rad: 0.002,
            least_sigma_m: 0.03,
            break_inflation: 25.0,
            most_odometry_factor: 1e4,
            most_correlated_s: 20.0,
            agreeing_share: 0.9,
            agreeing_chi2: 10.64,
            least_growth: 2.0,
            beyond_best: 4.0,
            elsewhere_m: 10.0,
            map_step_s: 0.33,
        }
    }
}

impl Default for LoopOptions {
    fn default() -> Self {
        Self { enabled: true, spacing_heights: 2.0, advanced: AdvancedLoopOptions::default() }
    }
}

impl LoopOptions {
    /// The first setting out of its range, with what it must be.
    ///
    /// # Errors
    /// Name and range of that setting.
    pub fn validate(&self) -> Result<(), String> {
        let advanced = &self.advanced;
        for (name, value) in [
            ("spacing_heights", self.spacing_heights),
            ("advanced.spacing_rad", advanced.spacing_rad),
            ("advanced.spacing_s", advanced.spacing_s),
            ("advanced.young_share", advanced.young_share),
            ("advanced.gate_m", advanced.gate_m),
            ("advanced.kernel_scale", advanced.kernel_scale),
            ("advanced.least_sigma_rad", advanced.least_sigma_rad),
            ("advanced.least_sigma_m", advanced.least_sigma_m),
            ("advanced.most_correlated_s", advanced.most_correlated_s),
            ("advanced.map_step_s", advanced.map_step_s),
            ("advanced.agreeing_chi2", advanced.agreeing_chi2),
            ("advanced.elsewhere_m", advanced.elsewhere_m),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(format!("loops.{name} must be positive"));
            }
        }
        for (name, value) in [
            ("advanced.correlation", advanced.correlation),
            ("advanced.break_inflation", advanced.break_inflation),
            ("advanced.most_odometry_factor", advanced.most_odometry_factor),
            ("advanced.beyond_best", advanced.beyond_best),
        ] {
            if !(value.is_finite() && value >= 1.0) {
                return Err(format!("loops.{name} must be at least 1"));
            }
        }
        // Growth by less takes hundreds of solutions.
        if !(advanced.least_growth.is_finite() && advanced.least_growth >= 1.1) {
            return Err("loops.advanced.least_growth must be at least 1.1".to_owned());
        }
        for (name, value) in [
            ("advanced.gate_share", advanced.gate_share),
            ("advanced.least_weight", advanced.least_weight),
            ("advanced.agreeing_share", advanced.agreeing_share),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("loops.{name} must lie between 0 and 1"));
            }
        }
        if !(advanced.young_s.is_finite() && advanced.young_s >= 0.0) {
            return Err("loops.advanced.young_s must not be negative".to_owned());
        }
        Ok(())
    }
}
