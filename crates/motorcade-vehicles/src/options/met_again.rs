//! Options of vehicles with several tracks.

/// When two passes by standing vehicles, or two tracks that move, are those of one vehicle, in drives that are estimated as a whole. None of these
/// numbers was measured.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MetAgainOptions {
    /// Farthest that two passes may see a vehicle apart \[m\]: half a car, less than from one parked car to the next. Chosen: a larger one joins passes
    /// after more drift, and neighbours.
    pub most_apart_m: f64,
    /// χ² of the distance of the two positions up to which they may be one: the quantile of χ²₂ at three standard deviations (99.7 %). A larger one
    /// has the same effect.
    pub gate_chi2: f64,
    /// Way of the camera between two tracks up to which standing vehicles in one place are one by odometry alone \[m\]: it drifts by a share of it, and
    /// 40 m are the way from which on places count as seen again. Chosen: a longer one joins neighbours after drift.
    pub most_gap_m: f64,
    /// Least cosine of the angle between the two headings, front and rear exchanged or not: 30°. Chosen: a smaller one joins vehicles that stand across
    /// the road to those along it.
    pub least_cosine: f64,
    /// Least length and height of one pass as a share of those of the other. Chosen: a larger one keeps vehicles of other sizes apart and misses
    /// passes whose size is badly known.
    pub least_size_share: f64,
    /// Time before and after a pass in which a place seen again still shows where its vehicle stands \[s\]: the odometry drifts little over it.
    /// Chosen: a longer one joins more passes, on the word of places farther away.
    pub near_loop_s: f64,
    /// Time for which two tracks that move have to be in one place to be one vehicle's \[s\]: two frames at ten a second, in a single one vehicles may meet by
    /// chance. Chosen: a longer one leaves more vehicles with two tracks.
    pub least_together_s: f64,
}

impl Default for MetAgainOptions {
    fn default() -> Self {
        Self {
            most_apart_m: 2.0,
            gate_chi2: 11.8,
            most_gap_m: 40.0,
            least_cosine: 0.866,
            least_size_share: 0.75,
            near_loop_s: 1.5,
            least_together_s: 0.08,
        }
    }
}

impl MetAgainOptions {
    /// The first setting out of its range, with what it must be.
    pub(super) fn validate(&self) -> Result<(), String> {
        for (name, value) in [
            ("most_apart_m", self.most_apart_m),
            ("gate_chi2", self.gate_chi2),
            ("most_gap_m", self.most_gap_m),
            ("near_loop_s", self.near_loop_s),
            ("least_together_s", self.least_together_s),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(format!("vehicles.advanced.met_again.{name} must not be negative"));
            }
        }
        if !(self.least_size_share > 0.0 && self.least_size_share <= 1.0) {
            return Err(
                "vehicles.advanced.met_again.least_size_share must lie above 0 and at most at 1".to_owned()
            );
        }
        Ok(())
    }
}
