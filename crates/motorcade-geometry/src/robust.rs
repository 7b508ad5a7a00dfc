//! Robust losses for iteratively reweighted least squares, and robust statistics.

use std::cmp::Ordering;
use std::fmt;
use std::str::FromStr;

/// Value and slope of a loss at a squared whitened residual `s = rᵀ Ω r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// ρ(s).
    pub cost: f64,
    /// ρ'(s): the weight in reweighted least squares.
    pub weight: f64,
}

/// A robust loss ρ of `s = rᵀ Ω r`, with ρ(0) = 0 and ρ'(0) = 1. Scales are in standard deviations: χ²₆(0.95) = 12.59
/// suggests c ≈ 3.55 for residuals of six dimensions. Weights only: the second-order term makes H indefinite for
/// outliers.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum RobustKernel {
    /// `s`: least squares.
    #[default]
    None,
    /// `s` up to c², `2c√s − c²` beyond. For heavy tails without gross outliers.
    Huber(f64),
    /// `c² ln(1 + s/c²)`. The best all-round choice against gross outliers.
    Cauchy(f64),
    /// `c² s / (c² + s)`: bounded.
    GemanMcClure(f64),
    /// Dynamic covariance scaling (Agarwal et al., ICRA 2013) with Φ in units of s: `s` up to Φ, then
    /// `Φ (3s − Φ) / (Φ + s)`.
    Dcs(f64),
    /// Tukey's biweight: constant beyond c.
    Tukey(f64),
}

impl RobustKernel {
    /// ρ(s) and ρ'(s).
    #[inline]
    pub fn loss(self, s: f64) -> Loss {
        Loss { cost: self.cost(s), weight: self.weight(s) }
    }

    /// ρ(s).
    #[inline]
    pub fn cost(self, s: f64) -> f64 {
        match self {
            Self::None => s,
            Self::Huber(c) => {
                if s <= c * c {
                    s
                } else {
                    2.0 * c * s.sqrt() - c * c
                }
            }
            Self::Cauchy(c) => c * c * (s / (c * c)).ln_1p(),
            Self::GemanMcClure(c) => s * (c * c / (c * c + s)),
            Self::Dcs(phi) => {
                if s <= phi {
                    s
                } else {
                    phi * (3.0 * s - phi) / (phi + s)
                }
            }
            Self::Tukey(c) => {
                let u = (1.0 - s / (c * c)).max(0.0);
                c * c / 3.0 * (1.0 - u * u * u)
            }
        }
    }

    /// ρ'(s), 1 for a zero residual.
    #[inline]
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Huber(c) => {
                if s <= c * c {
                    1.0
                } else {
                    c / s.sqrt()
                }
            }
            Self::Cauchy(c) => 1.0 / (1.0 + s / (c * c)),
            Self::GemanMcClure(c) => (c * c / (c * c + s)).powi(2),
            Self::Dcs(phi) => {
                if s <= phi {
                    1.0
                } else {
                    (2.0 * phi / (phi + s)).powi(2)
                }
            }
            Self::Tukey(c) => (1.0 - s / (c * c)).max(0.0).powi(2),
        }
    }
}

/// A kernel that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownKernel(String);

impl fmt::Display for UnknownKernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UnknownKernel {}

/// `none`, or a name and a positive scale such as `cauchy:3.5`; without one the scale is 1.
impl FromStr for RobustKernel {
    type Err = UnknownKernel;
    fn from_str(s: &str) -> Result<Self, UnknownKernel> {
        let wrong = |reason: String| Err(UnknownKernel(reason));
        let (name, scale) = s.split_once(':').unwrap_or((s, "1"));
        let Ok(c) = scale.parse::<f64>() else { return wrong(format!("{scale:?} is not a number")) };
        if !(c.is_finite() && c > 0.0) {
            return wrong(format!("the scale {c} must be positive"));
        }
        Ok(match name {
            "none" => Self::None,
            "huber" => Self::Huber(c),
            "cauchy" => Self::Cauchy(c),
            "geman-mcclure" | "gm" => Self::GemanMcClure(c),
            "dcs" => Self::Dcs(c),
            "tukey" => Self::Tukey(c),
            _ => {
                return wrong(format!("{name:?} is none of none, huber, cauchy, geman-mcclure, dcs, tukey"));
            }
        })
    }
}

impl fmt::Display for RobustKernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Huber(c) => write!(f, "huber:{c}"),
            Self::Cauchy(c) => write!(f, "cauchy:{c}"),
            Self::GemanMcClure(c) => write!(f, "geman-mcclure:{c}"),
            Self::Dcs(phi) => write!(f, "dcs:{phi}"),
            Self::Tukey(c) => write!(f, "tukey:{c}"),
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
    median_by(values, f64::total_cmp)
}

/// As [`median`], of values of any type in the order of `compare`.
pub fn median_by<T: Copy>(values: &mut [T], compare: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    let middle = values.len().saturating_sub(1) / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, compare).1)
}

/// The upper of the middle two values in the order of `compare`, of an odd number the middle one; `None` when there is none.
/// Reorders its input.
pub fn upper_median_by<T: Copy>(values: &mut [T], compare: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, compare).1)
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

    const KERNELS: [RobustKernel; 6] = [
        RobustKernel::None,
        RobustKernel::Huber(1.3),
        RobustKernel::Cauchy(2.0),
        RobustKernel::GemanMcClure(3.0),
        RobustKernel::Dcs(4.2),
        RobustKernel::Tukey(3.0),
    ];

    #[test]
    fn weights_are_the_slopes_of_the_costs() {
        for kernel in KERNELS {
            assert_eq!(kernel.loss(0.0), Loss { cost: 0.0, weight: 1.0 });
            for s in [0.01, 0.5, 1.0, 4.0, 8.0, 20.0, 1e4] {
                let h = 1e-6 * s;
                let slope = (kernel.cost(s + h) - kernel.cost(s - h)) / (2.0 * h);
                assert!((slope - kernel.weight(s)).abs() < 1e-6, "{kernel:?} at {s}");
            }
        }
    }

    #[test]
    fn medians_of_odd_and_even_numbers() {
        let all = |values: &[f64]| {
            let mut values = values.to_vec();
            let upper = upper_median_by(&mut values, f64::total_cmp);
            [median(&mut values), median_midpoint(&mut values), upper]
        };
        assert_eq!(all(&[3.0, 1.0, 2.0]), [Some(2.0); 3]);
        assert_eq!(all(&[4.0, 1.0, 8.0, 2.0]), [Some(2.0), Some(3.0), Some(4.0)]);
        assert_eq!(all(&[5.0]), [Some(5.0); 3]);
        assert_eq!(all(&[]), [None; 3]);
        assert_eq!(median_by(&mut [7_u64, 3, 5, 1], u64::cmp), Some(3));
    }

    #[test]
    fn kernels_have_names() {
        for kernel in KERNELS {
            assert_eq!(kernel.to_string().parse(), Ok(kernel));
        }
        for wrong in ["cauchy:-1", "cauchy:x", "square:1", "huber:nan"] {
            assert!(wrong.parse::<RobustKernel>().is_err(), "{wrong}");
        }
    }
}
