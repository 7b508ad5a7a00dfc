//! Axes: linear maps from values to pixels.

/// Linear map from values to pixels, with round tick values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    /// Lowest and highest value.
    pub values: [f64; 2],
    /// Their pixels.
    pub pixels: [f64; 2],
}

impl Axis {
    /// Pixel of a value.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let [low, high] = self.values;
        let [a, b] = self.pixels;
        a + (value - low) / (high - low) * (b - a)
    }

    /// Round values inside, about `count` of them, and the digits they need.
    pub(crate) fn marks(&self, count: f64) -> (Vec<f64>, usize) {
        let [low, high] = self.values;
        let step = round_step((high - low) / count);
        let digits = (-step.log10().floor()).max(0.0) as usize;
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        ((first..=last).map(|k| k as f64 * step).collect(), digits)
    }
}

/// The round step (1, 2 or 5 times a power of ten) next to or above `rough`.
pub(crate) fn round_step(rough: f64) -> f64 {
    if !(rough.is_finite() && rough > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|s| s * power >= rough * 0.999);
    step.unwrap_or(10.0) * power
}

/// Lowest and highest of finite values, widened by a share of their range and to at least `least`; none without values.
pub(crate) fn range(values: impl IntoIterator<Item = f64>, margin: f64, least: f64) -> Option<[f64; 2]> {
    let finite = values.into_iter().filter(|v| v.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    if low > high {
        return None;
    }
    let half = ((high - low) * (0.5 + margin)).max(0.5 * least);
    let middle = 0.5 * (low + high);
    Some([middle - half, middle + half])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_inside() {
        let axis = Axis { values: [-0.3, 12.4], pixels: [0.0, 100.0] };
        let (marks, digits) = axis.marks(6.0);
        assert_eq!(marks, vec![0.0, 5.0, 10.0]);
        assert_eq!(digits, 0);
        let (marks, digits) = Axis { values: [0.1, 0.5], pixels: [0.0, 1.0] }.marks(4.0);
        assert_eq!((marks.len(), digits), (5, 1));
    }

    #[test]
    fn ranges_hold_all_values_and_never_vanish() {
        assert_eq!(range([2.0, f64::NAN, 4.0], 0.5, 0.0), Some([1.0, 5.0]));
        assert_eq!(range([3.0, 3.0], 0.1, 2.0), Some([2.0, 4.0]));
        assert_eq!(range([f64::NAN], 0.1, 2.0), None);
    }
}
