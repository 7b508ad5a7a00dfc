//! Robust kernels as iteratively reweighted least-squares weights.

/// A robust kernel on the squared whitened residual norm `s = rᵀ Ω r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// Plain least squares.
    None,
    /// Huber with threshold c: quadratic below |r| = c, linear above.
    Huber(f64),
    /// Cauchy with scale c: `ρ = c² log(1 + s/c²)`.
    Cauchy(f64),
    /// Tukey's biweight with cut-off c: residuals beyond c have no say.
    Tukey(f64),
}

impl Kernel {
    /// The weight ρ'(s), 1 for a zero residual.
    #[inline]
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Kernel::None => 1.0,
            Kernel::Huber(c) => {
                if s <= c * c {
                    1.0
                } else {
                    c / s.sqrt()
                }
            }
            Kernel::Cauchy(c) => 1.0 / (1.0 + s / (c * c)),
            Kernel::Tukey(c) => {
                let u = 1.0 - s / (c * c);
                if u > 0.0 { u * u } else { 0.0 }
            }
        }
    }
    /// The cost ρ(s).
    #[inline]
    pub fn cost(self, s: f64) -> f64 {
        match self {
            Kernel::None => s,
            Kernel::Huber(c) => {
                if s <= c * c {
                    s
                } else {
                    2.0 * c * s.sqrt() - c * c
                }
            }
            Kernel::Cauchy(c) => c * c * (s / (c * c)).ln_1p(),
            Kernel::Tukey(c) => {
                let u = (1.0 - s / (c * c)).max(0.0);
                c * c / 3.0 * (1.0 - u * u * u)
            }
        }
    }
}

/// Value below which the given share of the values lies (nearest rank); reorders them. `None` of nothing.
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    let rank = (values.len().saturating_sub(1) as f64 * share.clamp(0.0, 1.0)).round() as usize;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// The median of the values (lower of the middle two); `None` when there is none. Reorders its input.
pub fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = (values.len() - 1) / 2;
    let (_, value, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*value)
}

/// The median with NumPy's convention: the mean of the two middle values of an even number; `None` when there is none. Reorders
/// its input.
pub fn median_midpoint(values: &mut [f64]) -> Option<f64> {
    let lower = median(values)?;
    // `median` leaves the larger values behind the middle one.
    let upper = values.get(values.len().div_ceil(2)..)?.iter().copied().min_by(f64::total_cmp);
    Some(match upper.filter(|_| values.len().is_multiple_of(2)) {
        Some(upper) => 0.5 * (lower + upper),
        None => lower,
    })
}

/// Standard deviation of the inliers from the median absolute value, for residuals centred at zero.
pub fn sigma_from_absolute(absolute_residuals: &mut [f64]) -> Option<f64> {
    median(absolute_residuals).map(|m| 1.4826 * m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_the_slope_of_the_cost() {
        for kernel in [Kernel::None, Kernel::Huber(1.3), Kernel::Cauchy(2.0), Kernel::Tukey(3.0)] {
            for s in [0.01, 0.5, 1.0, 4.0, 8.0, 20.0] {
                let h = 1e-6;
                let slope = (kernel.cost(s + h) - kernel.cost(s - h)) / (2.0 * h);
                assert!((slope - kernel.weight(s)).abs() < 1e-6, "{kernel:?} at {s}");
            }
        }
    }

    #[test]
    fn medians_of_odd_and_even_numbers() {
        let both = |values: &[f64]| {
            let mut values = values.to_vec();
            (median(&mut values), median_midpoint(&mut values))
        };
        assert_eq!(both(&[3.0, 1.0, 2.0]), (Some(2.0), Some(2.0)));
        assert_eq!(both(&[4.0, 1.0, 8.0, 2.0]), (Some(2.0), Some(3.0)));
        assert_eq!(both(&[5.0]), (Some(5.0), Some(5.0)));
        assert_eq!(both(&[]), (None, None));
    }

    #[test]
    fn median_of_nothing_is_none() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
    }
}
