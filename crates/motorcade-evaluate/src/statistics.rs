//! Means that are `None` without values.

use nalgebra::Vector3;

/// Root mean square of lengths, in their unit; `None` without values.
pub(crate) fn rms(errors: impl IntoIterator<Item = Vector3<f64>>) -> Option<f64> {
    mean(errors.into_iter().map(|e| e.norm_squared())).map(f64::sqrt)
}

/// Arithmetic mean; `None` without values.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.into_iter().fold((0usize, 0.0), |(n, sum), v| (n + 1, sum + v));
    (count > 0).then(|| sum / count as f64)
}
