//! Constant velocity over intervals of any length.

use motorcade_geometry::{Camera, Pose};
use nalgebra::Vector6;

use crate::time::{ratio, seconds};

/// A twist `[ω, ν]` over an interval, in the camera.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Velocity {
    twist: Vector6<f64>,
    interval_ns: i64,
}

impl Velocity {
    /// No motion.
    pub fn zero() -> Self {
        Self { twist: Vector6::zeros(), interval_ns: 0 }
    }

    /// From the motion over `interval_ns`, which holds `frames` frames.
    pub fn new(motion: &Vector6<f64>, interval_ns: i64, frames: usize) -> Self {
        let frames = frames.max(1);
        Self { twist: motion / frames as f64, interval_ns: interval_ns / frames as i64 }
    }

    /// True when `ns` is longer than `intervals` of those that it was measured over.
    pub fn is_outlasted_by(&self, ns: i64, intervals: u32) -> bool {
        self.interval_ns > 0 && ns > self.interval_ns.saturating_mul(i64::from(intervals))
    }

    /// The twist over a time \[s\].
    pub fn twist_over(&self, time_s: f64) -> Vector6<f64> {
        if self.interval_ns == 0 {
            Vector6::zeros()
        } else {
            self.twist * (time_s / seconds(self.interval_ns))
        }
    }

    /// The motion over the interval that it was measured over.
    pub fn once(&self) -> Pose<Camera, Camera> {
        Pose::exp(&self.twist)
    }

    /// The motion over another interval \[ns\]; negative leads back.
    pub fn over(&self, ns: i64) -> Pose<Camera, Camera> {
        let forward = Pose::exp(&(self.twist * ratio(ns.abs(), self.interval_ns)));
        if ns < 0 { forward.inverse() } else { forward }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_is_proportional_to_time() {
        let motion = Vector6::new(0.0, 0.02, 0.0, 0.1, 0.0, 1.0);
        let velocity = Velocity::new(&motion, 100_000_000, 1);
        assert!((velocity.over(20_000_000).log() - motion * 0.2).norm() < 1e-12);
        assert!((velocity.over(-100_000_000).log() + motion).norm() < 1e-12);
        // The same over several frames at once.
        let several = Velocity::new(&(motion * 3.0), 300_000_000, 3);
        assert!((several.over(100_000_000).log() - motion).norm() < 1e-12);
        assert!((several.once().log() - motion).norm() < 1e-12);
        assert!(several.is_outlasted_by(600_000_000, 5) && !several.is_outlasted_by(500_000_000, 5));
        assert_eq!(Velocity::zero().over(5).log().norm(), 0.0);
    }
}
