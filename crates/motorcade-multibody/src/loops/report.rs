//! Report of loop closing.

/// Report of loop closing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopReport {
    /// Weight of each edge at the end, 0 to 1; those below the least one count as no loop.
    pub weights: Vec<f64>,
    /// True for edges that hold.
    pub closed: Vec<bool>,
    /// The same two for edges to a kept map: weight, and whether it holds.
    pub map: Vec<(f64, bool)>,
    /// Factor on the covariance of the odometry, 1 where nine tenths of the edges agree with it as it is.
    pub odometry_factor: f64,
    /// Farthest that a camera was moved by the correction \[m\].
    pub most_moved_m: f64,
}

impl LoopReport {
    /// Number of edges that hold.
    pub fn closed_count(&self) -> usize {
        self.closed.iter().filter(|closed| **closed).count()
    }
}
