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

/// The roots of a quartic in (0, upper) at which it changes its sign, in order; those of [`sign_changes`] to thirteen digits, in a
/// tenth of the time.
pub(crate) fn quartic_sign_changes(quartic: &[f64; 5], upper: f64) -> ([f64; 4], usize) {
    let [_, c1, c2, c3, c4] = *quartic;
    let (mut ends, mut count) = quadratic_roots([2.0 * c2, 6.0 * c3, 12.0 * c4], upper);
    let derivative = [c1, 2.0 * c2, 3.0 * c3, 4.0 * c4];
    // The roots of each lie between those of its derivative.
    for c in [&derivative[..], &quartic[..]] {
        let (mut low, mut roots, mut found) = (0.0, [0.0; 4], 0);
        for k in 0..=count {
            let high = if k < count { ends[k] } else { upper };
            if value(c, low) * value(c, high) < 0.0 && found < 4 {
                roots[found] = newton(c, low, high);
                found += 1;
            }
            low = high;
        }
        (ends, count) = (roots, found);
    }
    (ends, count)
}

/// Real roots in (0, upper), in order.
fn quadratic_roots([c, b, a]: [f64; 3], upper: f64) -> ([f64; 4], usize) {
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    let sum = -0.5 * (b + root.copysign(b));
    let [x, y] = [sum / a, c / sum];
    let (mut roots, mut count) = ([0.0; 4], 0);
    for x in [x.min(y), x.max(y)] {
        if x > 0.0 && x < upper {
            roots[count] = x;
            count += 1;
        }
    }
    (roots, count)
}

/// The root between two values of opposite signs: Newton's steps, halvings where they leave the interval.
fn newton(coefficients: &[f64], mut low: f64, mut high: f64) -> f64 {
    const MOST_STEPS: usize = 80;
    let rising = value(coefficients, low) < 0.0;
    let mut x = 0.5 * (low + high);
    for _ in 0..MOST_STEPS {
        let (mut y, mut slope) = (0.0, 0.0);
        for c in coefficients.iter().rev() {
            slope = slope * x + y;
            y = y * x + c;
        }
        if (y < 0.0) == rising {
            low = x
        } else {
            high = x
        }
        let step = x - y / slope;
        let next = if step > low && step < high { step } else { 0.5 * (low + high) };
        if (next - x).abs() <= 1e-13 * x.abs() {
            return next;
        }
        x = next;
    }
    x
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
    fn quartics_have_the_roots_that_halving_finds() {
        let mut next = 7_u64;
        let mut random = || {
            next = next.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (next >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut compared, mut roots) = (0, 0);
        for _ in 0..2000 {
            // Roots of all sizes, some of them negative or complex.
            let scale = 10.0_f64.powf(4.0 * random() - 2.0);
            let factor = |r: &mut dyn FnMut() -> f64| [scale * (r() - 0.3), r() - 0.5, 1.0];
            let q = product(&factor(&mut random), &factor(&mut random));
            let quartic: [f64; 5] = std::array::from_fn(|k| q[k]);
            let slow = sign_changes(&quartic, 1e3);
            let (fast, count) = quartic_sign_changes(&quartic, 1e3);
            assert_eq!(slow.len(), count, "{quartic:?}: {slow:?} {fast:?}");
            for (a, b) in slow.iter().zip(fast) {
                assert!((a - b).abs() < 1e-9 * (1.0 + a), "{quartic:?}: {a} {b}");
                roots += 1;
            }
            compared += 1;
        }
        assert!(compared == 2000 && roots > 1500, "{roots}");
        let (_, none) = quartic_sign_changes(&[f64::NAN; 5], 1e3);
        assert_eq!(none, 0);
    }

    #[test]
    fn a_double_root_is_no_change_of_sign() {
        assert_eq!(first_positive_root(&product(&[-1.0, 1.0], &[-1.0, 1.0]), 10.0), None);
        assert_eq!(first_positive_root(&[1.0], 10.0), None);
        assert_eq!(first_positive_root(&[1.0, 0.0, 0.0, 0.0], 10.0), None);
    }
}
