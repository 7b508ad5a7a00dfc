//! Robust kernels: wrappers that change a factor's loss and nothing else.
//!
//! All act on the whitened squared norm `s = rᵀ Ω r` and are used by reweighting with `ρ'(s)` (no second-order
//! term, which makes H indefinite for outliers). `c` is in whitened units: χ²₆(0.95) = 12.59 suggests c ≈ 3.55 for
//! six-dimensional residuals.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::{DMatrixViewMut, DVectorViewMut};

use crate::GraphError;
use crate::factor::{Factor, Loss, Normal, RelativePose, Terms};
use crate::values::Values;

/// A loss function of `s = rᵀ Ω r`.
pub trait Kernel: fmt::Debug + Send + Sync {
    /// ρ(s) and ρ'(s), with ρ(0) = 0 and ρ'(0) = 1.
    fn loss(&self, s: f64) -> Loss;
}

/// Quadratic up to |r| = c, linear beyond. For heavy tails without gross outliers.
#[derive(Clone, Copy, Debug)]
pub struct Huber {
    /// Threshold on the whitened norm.
    pub c: f64,
}

impl Kernel for Huber {
    fn loss(&self, s: f64) -> Loss {
        if s <= self.c * self.c {
            return Loss { cost: s, weight: 1.0 };
        }
        let norm = s.sqrt();
        Loss { cost: 2.0 * self.c * norm - self.c * self.c, weight: self.c / norm }
    }
}

/// `c² ln(1 + s/c²)`. The best all-round choice against gross outliers.
#[derive(Clone, Copy, Debug)]
pub struct Cauchy {
    /// Scale of the whitened norm.
    pub c: f64,
}

impl Kernel for Cauchy {
    fn loss(&self, s: f64) -> Loss {
        let c2 = self.c * self.c;
        let x = s / c2;
        Loss { cost: c2 * x.ln_1p(), weight: 1.0 / (1.0 + x) }
    }
}

/// `c² s / (c² + s)`: bounded.
#[derive(Clone, Copy, Debug)]
pub struct GemanMcClure {
    /// Scale of the whitened norm.
    pub c: f64,
}

impl Kernel for GemanMcClure {
    fn loss(&self, s: f64) -> Loss {
        let c2 = self.c * self.c;
        let w = c2 / (c2 + s);
        Loss { cost: s * w, weight: w * w }
    }
}

/// Dynamic covariance scaling (Agarwal et al., ICRA 2013): `s` up to Φ, then `Φ (3s − Φ) / (Φ + s)`.
#[derive(Clone, Copy, Debug)]
pub struct Dcs {
    /// Φ, in units of s.
    pub phi: f64,
}

impl Kernel for Dcs {
    fn loss(&self, s: f64) -> Loss {
        if s <= self.phi {
            return Loss { cost: s, weight: 1.0 };
        }
        let sum = self.phi + s;
        let w = 2.0 * self.phi / sum;
        Loss { cost: self.phi * (3.0 * s - self.phi) / sum, weight: w * w }
    }
}

/// Graduated non-convexity on Geman–McClure (Yang et al., RA-L 2020): `μc² s / (μc² + s)`, convex for large μ and
/// Geman–McClure at μ = 1. Clones share μ, which [`graduate`](crate::solver::graduate) lowers.
#[derive(Clone, Debug)]
pub struct Gnc {
    /// Scale of the whitened norm at μ = 1.
    pub c: f64,
    mu: Arc<AtomicU64>,
}

impl Gnc {
    /// Starts as plain least squares (μ = ∞).
    pub fn new(c: f64) -> Self {
        Self { c, mu: Arc::new(AtomicU64::new(f64::INFINITY.to_bits())) }
    }
    /// Current μ.
    pub fn mu(&self) -> f64 {
        f64::from_bits(self.mu.load(Ordering::Relaxed))
    }
    /// Sets μ for this kernel and all its clones. Not while a solver runs.
    pub fn set_mu(&self, mu: f64) {
        self.mu.store(mu.to_bits(), Ordering::Relaxed);
    }
}

impl Kernel for Gnc {
    fn loss(&self, s: f64) -> Loss {
        let mu = self.mu();
        if mu.is_infinite() {
            return Loss { cost: s, weight: 1.0 };
        }
        GemanMcClure { c: self.c * mu.sqrt() }.loss(s)
    }
}

impl Kernel for Box<dyn Kernel> {
    fn loss(&self, s: f64) -> Loss {
        (**self).loss(s)
    }
}

/// A factor under a robust kernel.
#[derive(Clone, Debug)]
pub struct Robust<F, K> {
    /// What is measured.
    pub factor: F,
    /// How much a large residual counts.
    pub kernel: K,
}

impl<F: Factor, K: Kernel> Robust<F, K> {
    /// Wraps `factor`.
    pub fn new(factor: F, kernel: K) -> Self {
        Self { factor, kernel }
    }
}

impl<F: Factor, K: Kernel> Factor for Robust<F, K> {
    fn terms(&self) -> Terms<'_> {
        self.factor.terms()
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        self.factor.evaluate(values, residual, jacobian)
    }
    fn loss(&self, s: f64) -> Loss {
        // A kernel over a kernel: the chain rule.
        let inner = self.factor.loss(s);
        let outer = self.kernel.loss(inner.cost);
        Loss { cost: outer.cost, weight: outer.weight * inner.weight }
    }
    fn squared_norm(&self, values: &Values) -> Result<f64, GraphError> {
        self.factor.squared_norm(values)
    }
    fn normal_equations(&self, values: &Values, out: &mut Normal) -> Result<f64, GraphError> {
        self.factor.normal_equations(values, out)
    }
    fn relative_pose(&self) -> Option<RelativePose<'_>> {
        self.factor.relative_pose()
    }
    fn relative_plane(&self) -> Option<&nalgebra::Isometry2<f64>> {
        self.factor.relative_plane()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_the_slopes_of_the_losses() {
        let gnc = Gnc::new(2.0);
        gnc.set_mu(3.0);
        let kernels: [Box<dyn Kernel>; 5] = [
            Box::new(Huber { c: 1.5 }),
            Box::new(Cauchy { c: 2.0 }),
            Box::new(GemanMcClure { c: 3.0 }),
            Box::new(Dcs { phi: 4.0 }),
            Box::new(gnc),
        ];
        for kernel in &kernels {
            assert!(kernel.loss(0.0).cost.abs() < 1e-15 && (kernel.loss(0.0).weight - 1.0).abs() < 1e-15);
            for s in [0.01, 0.7, 2.0, 3.9, 4.1, 30.0, 1e4] {
                let h = 1e-6 * s;
                let slope = (kernel.loss(s + h).cost - kernel.loss(s - h).cost) / (2.0 * h);
                let weight = kernel.loss(s).weight;
                assert!((slope - weight).abs() < 1e-7 + 1e-5 * weight, "{kernel:?} at {s}: {slope} {weight}");
            }
        }
    }
}
