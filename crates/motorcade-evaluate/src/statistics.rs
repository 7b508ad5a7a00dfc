//! Means that say what they do with nothing.

use nalgebra::Vector3;

/// Root mean square of lengths \[same unit\]; `None` of nothing.
pub(crate) fn rms(errors: impl IntoIterator<Item = Vector3<f64>>) -> Option<f64> {
    mean(errors.into_iter().map(|e| e.norm_squared())).map(f64::sqrt)
}

/// `None` of nothing.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.into_iter().fold((0usize, 0.0), |(n, sum), v| (n + 1, sum + v));
    (count > 0).then(|| sum / count as f64)
}

/// Mean of the two middle values for an even number; `None` of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    Some(if values.len() % 2 == 1 { upper } else { 0.5 * (values[values.len() / 2 - 1] + upper) })
}

/// Value below which the given share lies (nearest rank); `None` of nothing.
pub(crate) fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (values.len().saturating_sub(1) as f64 * share).round() as usize;
    values.get(rank).copied()
}
