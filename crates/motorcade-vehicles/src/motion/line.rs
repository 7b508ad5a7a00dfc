//! A straight line through positions over time.

use nalgebra::{Matrix3, Vector3};

use crate::motion::PositionMeasurement;
use crate::options::KinematicStateOptions;
use motorcade_geometry::robust::median;

/// Median of χ² with one degree of freedom: the residuals lie along the line of sight, nearly.
const MEDIAN_CHI2: f64 = 0.455;

/// A straight line through positions, each weighted by its variance and by how far it lies from the line against the others: boxes at the ends of
/// a track, cut off or small, are often those of something else.
pub(crate) struct Line<'a> {
    positions: &'a [PositionMeasurement],
    /// Weight of each position \[1/m²\].
    weights: Vec<f64>,
    /// Sum of the weights \[1/m²\].
    pub(crate) information: f64,
    mean_time_s: f64,
    /// Weighted sum of squared times from the mean \[s²/m²\].
    levers: f64,
}

impl<'a> Line<'a> {
    /// Iteratively reweighted least squares with the weights of Student's t distribution (Lange, Little & Taylor, JASA 84, 1989), its scale by the
    /// median residual.
    pub(crate) fn new(positions: &'a [PositionMeasurement], options: &KinematicStateOptions) -> Self {
        let KinematicStateOptions { line_dof: dof, line_least_scale: least_scale, .. } = *options;
        let by_variance: Vec<f64> = positions.iter().map(weight).collect();
        let mut line = Self::weighted(positions, by_variance.clone());
        for _ in 0..options.line_rounds {
            let squares = line.squared_residuals();
            let normed: Vec<f64> = squares.iter().zip(&by_variance).map(|(r2, w)| r2 * w).collect();
            let Some(middle) = median(&mut normed.clone()) else { break };
            // A line takes two of the residuals of few positions.
            let spare = positions.len() as f64 / positions.len().saturating_sub(2).max(1) as f64;
            let scale = (middle * spare / MEDIAN_CHI2).max(least_scale);
            let weights = normed.iter().zip(&by_variance).map(|(n, w)| w * (dof + 1.0) / (dof + n / scale));
            line = Self::weighted(positions, weights.collect());
        }
        line
    }

    fn weighted(positions: &'a [PositionMeasurement], weights: Vec<f64>) -> Self {
        let information: f64 = weights.iter().sum();
        let mean_time_s =
            positions.iter().zip(&weights).map(|(p, w)| w * p.time_s).sum::<f64>() / information;
        let lever = |(p, w): (&PositionMeasurement, &f64)| w * (p.time_s - mean_time_s).powi(2);
        let levers = positions.iter().zip(&weights).map(lever).sum::<f64>().max(1e-9);
        Self { positions, weights, information, mean_time_s, levers }
    }

    /// Positions and their levers.
    fn levers(&self) -> impl Iterator<Item = (&PositionMeasurement, f64)> {
        self.positions.iter().zip(&self.weights).map(|(p, w)| (p, w * (p.time_s - self.mean_time_s)))
    }

    /// Slope over time of a vector at each position \[1/s\].
    pub(crate) fn slope_of(&self, value: impl Fn(&PositionMeasurement) -> Vector3<f64>) -> Vector3<f64> {
        self.levers().map(|(p, lever)| value(p) * lever).sum::<Vector3<f64>>() / self.levers
    }

    /// Covariance of the velocity by independent positions (3×3) \[m²/s²\].
    pub(crate) fn velocity_covariance(&self) -> Matrix3<f64> {
        self.levers().map(|(p, lever)| p.covariance * (lever / self.levers).powi(2)).sum()
    }

    /// Mean squared distance of the positions from the line over that which their covariances state; 1 without any to spare.
    pub(crate) fn reduced_scatter(&self) -> f64 {
        let spare = self.positions.len().saturating_sub(2);
        if spare == 0 {
            return 1.0;
        }
        let squares = self.squared_residuals();
        squares.iter().zip(&self.weights).map(|(r2, w)| r2 * w).sum::<f64>() / spare as f64
    }

    /// Squared distance of each position from the line \[m²\].
    fn squared_residuals(&self) -> Vec<f64> {
        let velocity = self.velocity();
        let weighted = self.positions.iter().zip(&self.weights).map(|(p, w)| p.position * *w);
        let mean = weighted.sum::<Vector3<f64>>() / self.information;
        let squared = |p: &PositionMeasurement| {
            (p.position - mean - velocity * (p.time_s - self.mean_time_s)).norm_squared()
        };
        self.positions.iter().map(squared).collect()
    }

    /// Slope over time of the positions \[m/s\].
    pub(crate) fn velocity(&self) -> Vector3<f64> {
        self.slope_of(|p| p.position)
    }
}

fn weight(p: &PositionMeasurement) -> f64 {
    1.0 / p.covariance.trace().max(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::kinematic_state::tests::positions;

    /// The last boxes of an oncoming lorry, cut off by the border, place it ten metres too far.
    #[test]
    fn boxes_at_the_end_that_lie_elsewhere_count_little() {
        let mut seen = positions(-6.0);
        seen[28..].iter_mut().for_each(|p| p.position.z += 10.0);
        let (line, by_variance) = (
            Line::new(&seen, &KinematicStateOptions::default()),
            Line::weighted(&seen, seen.iter().map(weight).collect()),
        );
        assert!((line.velocity().z + 6.0).abs() < 0.1, "{}", line.velocity());
        assert!((by_variance.velocity().z + 6.0).abs() > 1.0, "{}", by_variance.velocity());
        assert!(line.reduced_scatter() < 0.1 * by_variance.reduced_scatter());
    }
}
