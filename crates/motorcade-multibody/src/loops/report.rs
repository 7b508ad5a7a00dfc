//! Report of loop closing.

/// Report of loop closing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopReport {
    /// Weight of each edge at the end, 0 to 1; those below the least one count as no loop.
    pub weights: Vec<f64>,
    /// True for edges that hold.
    pub closed: Vec<bool>,
    /// Farthest that a camera was moved by the correction \[m\].
    pub most_moved_m: f64,
}

impl LoopReport {
    /// Number of edges that hold.
    pub fn closed_count(&self) -> usize {
        self.closed.iter().filter(|closed| **closed).count()
    }
}
