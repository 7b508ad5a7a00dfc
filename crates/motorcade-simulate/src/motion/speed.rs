//! Speed over time.

/// Speeds at times, linear in between, constant outside.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedPlan {
    knots: Vec<(f64, f64)>,
}

impl SpeedPlan {
    /// Constant speed \[m/s\].
    pub fn constant(speed_m_s: f64) -> Self {
        Self { knots: vec![(0.0, speed_m_s)] }
    }
    /// From (time \[s\], speed \[m/s\]) in any order.
    pub fn through(knots: &[(f64, f64)]) -> Self {
        let mut knots = knots.to_vec();
        knots.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { knots }
    }
    /// The same plan with all speeds multiplied by a factor.
    #[must_use]
    pub(crate) fn times(&self, factor: f64) -> Self {
        Self { knots: self.knots.iter().map(|(time_s, speed)| (*time_s, speed * factor)).collect() }
    }
    /// Speed \[m/s\] at a time \[s\].
    pub fn at(&self, time_s: f64) -> f64 {
        let after = self.knots.partition_point(|k| k.0 <= time_s);
        match (after.checked_sub(1).and_then(|i| self.knots.get(i)), self.knots.get(after)) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (time_s - a.0) / (b.0 - a.0),
            (Some(only), None) | (None, Some(only)) => only.1,
            (None, None) => 0.0,
        }
    }
    /// Distance driven from 0 to a time \[m\].
    pub fn distance_m(&self, time_s: f64) -> f64 {
        const STEPS_PER_S: f64 = 50.0;
        let steps = (time_s * STEPS_PER_S).ceil().max(0.0) as usize;
        (0..steps).map(|i| self.at((i as f64 + 0.5) / STEPS_PER_S) / STEPS_PER_S).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_linear_between_knots_and_flat_outside() {
        let plan = SpeedPlan::through(&[(4.0, 8.0), (2.0, 0.0)]);
        assert_eq!([plan.at(0.0), plan.at(3.0), plan.at(9.0)], [0.0, 4.0, 8.0]);
        assert!((plan.distance_m(5.0) - 16.0).abs() < 1e-6);
    }
}
