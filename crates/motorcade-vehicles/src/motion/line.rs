//! A straight line through positions over time.

use nalgebra::{Matrix3, Vector3};

use crate::motion::PositionMeasurement;

/// A straight line through positions, each weighted by its variance.
pub(crate) struct Line<'a> {
    positions: &'a [PositionMeasurement],
    /// Sum of the weights \[1/m²\].
    pub(crate) information: f64,
    mean_time_s: f64,
    /// Weighted sum of squared times from the mean \[s²/m²\].
    levers: f64,
}

impl<'a> Line<'a> {
    pub(crate) fn new(positions: &'a [PositionMeasurement]) -> Self {
        let information: f64 = positions.iter().map(weight).sum();
        let mean_time_s = positions.iter().map(|p| weight(p) * p.time_s).sum::<f64>() / information;
        let mut line = Self { positions, information, mean_time_s, levers: 0.0 };
        let levers: f64 = positions.iter().map(|p| line.lever(p) * (p.time_s - mean_time_s)).sum();
        line.levers = levers.max(1e-9);
        line
    }

    fn lever(&self, p: &PositionMeasurement) -> f64 {
        weight(p) * (p.time_s - self.mean_time_s)
    }

    /// Slope over time of a vector at each position \[1/s\].
    pub(crate) fn slope_of(&self, value: impl Fn(&PositionMeasurement) -> Vector3<f64>) -> Vector3<f64> {
        self.positions.iter().map(|p| value(p) * self.lever(p)).sum::<Vector3<f64>>() / self.levers
    }

    /// Covariance of the velocity by independent positions (3×3) \[m²/s²\].
    pub(crate) fn velocity_covariance(&self) -> Matrix3<f64> {
        let of = |p: &PositionMeasurement| p.covariance * (self.lever(p) / self.levers).powi(2);
        self.positions.iter().map(of).sum()
    }

    /// Mean squared distance of the positions from the line over that which their covariances state; 1 without any to spare.
    pub(crate) fn reduced_scatter(&self) -> f64 {
        let spare = self.positions.len().saturating_sub(2);
        if spare == 0 {
            return 1.0;
        }
        let velocity = self.velocity();
        let weighted = |p: &PositionMeasurement| p.position * weight(p);
        let mean = self.positions.iter().map(weighted).sum::<Vector3<f64>>() / self.information;
        let squared = |p: &PositionMeasurement| {
            weight(p) * (p.position - mean - velocity * (p.time_s - self.mean_time_s)).norm_squared()
        };
        self.positions.iter().map(squared).sum::<f64>() / spare as f64
    }

    /// Slope over time of the positions \[m/s\].
    pub(crate) fn velocity(&self) -> Vector3<f64> {
        self.slope_of(|p| p.position)
    }
}

fn weight(p: &PositionMeasurement) -> f64 {
    1.0 / p.covariance.trace().max(1e-6)
}
