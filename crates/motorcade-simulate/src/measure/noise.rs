//! Random errors of measurements.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::hash;

/// Random stream of one purpose in one frame, so that frames can be simulated in any order.
pub(crate) struct Noise(ChaCha8Rng);

impl Noise {
    pub(crate) fn of(seed: u64, purpose: u64, frame: usize) -> Self {
        Self(ChaCha8Rng::seed_from_u64(hash::mix(seed ^ hash::mix(purpose)) ^ frame as u64))
    }
    /// Normal with mean 0 and standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        f64::from(hash::normal(self.0.random()))
    }
    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        self.0.random()
    }
    /// Uniform in [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}
