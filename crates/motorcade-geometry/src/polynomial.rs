//! Real roots of polynomials of low degree.

/// Halvings that bring an interval of length 1e4 below the last digit of any root above 1e-40.
const MOST_HALVINGS: usize = 200;

/// Value of Σ cᵢ xⁱ.
pub(crate) fn value(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Product of two polynomials.
pub(crate) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; (a.len() + b.len()).saturating_sub(1)];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            out[i + j] += a * b;
        }
    }
    out
}

/// The smallest root in (0, upper) at which the polynomial changes its sign.
pub(crate) fn first_positive_root(coefficients: &[f64], upper: f64) -> Option<f64> {
    sign_changes(coefficients, upper).first().copied()
}

/// All of them, in order: between two neighbouring extrema there is at most one.
pub(crate) fn sign_changes(coefficients: &[f64], upper: f64) -> Vec<f64> {
    if coefficients.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> = coefficients.iter().enumerate().skip(1).map(|(i, c)| i as f64 * c).collect();
    let ends = sign_changes(&derivative, upper).into_iter().chain([upper]);
    let mut low = 0.0;
    let mut roots = Vec::new();
    for high in ends {
        if value(coefficients, low) * value(coefficients, high) < 0.0 {
            roots.push(bisect(|x| value(coefficients, x), low, high));
        }
        low = high;
    }
    roots
}

/// The zero of a function whose values at the ends differ in sign, to the last digit.
pub(crate) fn bisect(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let rising = f(low) < 0.0;
    for _ in 0..MOST_HALVINGS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (f(middle) < 0.0) == rising { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_products_are_found() {
        // (x − 1)(x − 2)(x + 3)(x² + 1)
        let p =
            [[-1.0, 1.0], [-2.0, 1.0], [3.0, 1.0]].iter().fold(vec![1.0, 0.0, 1.0], |p, q| product(&p, q));
        let roots = sign_changes(&p, 10.0);
        assert_eq!(roots.len(), 2, "{roots:?}");
        assert!((roots[0] - 1.0).abs() < 1e-14 && (roots[1] - 2.0).abs() < 1e-14, "{roots:?}");
        assert_eq!(first_positive_root(&p, 0.5), None);
    }

    #[test]
    fn a_double_root_is_no_change_of_sign() {
        assert_eq!(first_positive_root(&product(&[-1.0, 1.0], &[-1.0, 1.0]), 10.0), None);
        assert_eq!(first_positive_root(&[1.0], 10.0), None);
        assert_eq!(first_positive_root(&[1.0, 0.0, 0.0, 0.0], 10.0), None);
    }
}
