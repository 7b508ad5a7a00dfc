//! Groups of factors whose losses are scaled together.

use motorcade_geometry::robust::Loss;

/// Name of a group of factors of one graph.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
)]
pub struct GroupId(pub(crate) u32);

/// Scale of the losses of a group: `ρ_group(s) = amplitude · ρ(s / variance)` for `s = rᵀ Ω r`.
///
/// A variance f with amplitude 1 multiplies the covariances of the group's factors by f. Both equal to μ give graduated
/// non-convexity (Yang et al., RA-L 2020): for [`RobustKernel::GemanMcClure`](motorcade_geometry::robust::RobustKernel)
/// `μc² s / (μc² + s)`, convex for large μ and least squares at infinity.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LossScale {
    /// Factor on the covariances inside the kernel.
    pub variance: f64,
    /// Factor on the cost.
    pub amplitude: f64,
}

impl Default for LossScale {
    fn default() -> Self {
        Self::variance(1.0)
    }
}

impl LossScale {
    /// Covariances multiplied by a factor.
    pub fn variance(variance: f64) -> Self {
        Self { variance, amplitude: 1.0 }
    }

    /// Convexity μ of graduated non-convexity; infinity is least squares.
    pub fn convexity(mu: f64) -> Self {
        Self { variance: mu, amplitude: mu }
    }

    /// The loss of a factor at `s`.
    #[inline]
    pub(crate) fn apply(self, s: f64, loss: impl FnOnce(f64) -> Loss) -> Loss {
        if self.variance.is_infinite() {
            return Loss { cost: s, weight: 1.0 };
        }
        let scaled = loss(s / self.variance);
        Loss { cost: scaled.cost * self.amplitude, weight: scaled.weight * self.amplitude / self.variance }
    }
}

#[cfg(test)]
mod tests {
    use motorcade_geometry::robust::RobustKernel;

    use super::*;

    #[test]
    fn weights_are_the_slopes_of_the_costs() {
        let kernel = RobustKernel::GemanMcClure(2.0);
        let least_squares = LossScale::convexity(f64::INFINITY);
        for scale in [LossScale::variance(3.0), LossScale::convexity(5.0), least_squares] {
            let at = |s: f64| scale.apply(s, |s| kernel.loss(s));
            for s in [0.01, 0.7, 4.0, 30.0, 1e4] {
                let h = 1e-6 * s;
                let slope = (at(s + h).cost - at(s - h).cost) / (2.0 * h);
                assert!((slope - at(s).weight).abs() < 1e-6, "{scale:?} at {s}");
            }
        }
        let (mu, c, s) = (5.0, 2.0, 7.0);
        let cost = LossScale::convexity(mu).apply(s, |s| RobustKernel::GemanMcClure(c).loss(s)).cost;
        assert!((cost - mu * c * c * s / (mu * c * c + s)).abs() < 1e-12);
    }
}
