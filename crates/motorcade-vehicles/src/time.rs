//! Frame intervals, and the number of independent views in a time.

use crate::ground::GroundFrame;

/// Slack of comparisons between counts of views.
const ROUNDING: f64 = 1e-6;

/// A difference of times, rounded to nanoseconds so that equal intervals are equal numbers \[s\].
pub(crate) fn interval_s(from_s: f64, to_s: f64) -> f64 {
    ((to_s - from_s) * 1e9).round() * 1e-9
}

/// Mean interval of frames \[s\]; `None` for fewer than two.
pub(crate) fn frame_interval_s(times_s: &[f64]) -> Option<f64> {
    let (first, last) = (times_s.first()?, times_s.last()?);
    let steps = times_s.len().checked_sub(1).filter(|steps| *steps > 0)?;
    Some(interval_s(0.0, (last - first) / steps as f64))
}

/// Variance inflation of measurements at an interval whose errors are correlated over a time: information grows with time, not with
/// the frame rate. At least 1.
pub(crate) fn correlation_factor(correlation_time_s: f64, interval_s: f64) -> f64 {
    (correlation_time_s / interval_s.max(1e-6)).max(1.0)
}

/// Number of independent views among `count` over a duration, at most `limit`.
pub(crate) fn independent_views(count: usize, duration_s: f64, correlation_time_s: f64, limit: f64) -> f64 {
    let in_time = interval_s(0.0, duration_s) / correlation_time_s.max(1e-9) + 1.0;
    let count = count as f64;
    // A view per correlation time counts fully, whatever the rounding of times.
    if in_time + ROUNDING >= count { count.min(limit) } else { in_time.min(limit) }
}

/// Times of a range of frames \[s\].
pub(crate) fn times_s(grounds: &[GroundFrame]) -> Vec<f64> {
    grounds.iter().map(|g| g.time_s).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn information_grows_with_time_not_with_the_frame_rate() {
        for fps in [2.0, 5.0, 10.0, 25.0, 50.0, 60.0] {
            let times: Vec<f64> = (0..=60).map(|k| (f64::from(k) / fps * 1e9).round() * 1e-9).collect();
            let interval = frame_interval_s(&times).unwrap();
            let count = times.len();
            let independent = independent_views(count, 60.0 / fps, 0.1, f64::MAX);
            // The same information from counted views and from inflated variances.
            let inflated = count as f64 / correlation_factor(0.1, interval);
            assert!((independent - inflated).abs() < 1.0, "{fps}: {independent} {inflated}");
        }
        assert_eq!(frame_interval_s(&[0.1, 0.2, 0.1 + 0.2]), Some(0.1));
        assert_eq!(correlation_factor(0.1, interval_s(0.7, 0.1 + 0.7)), 1.0);
        assert_eq!(independent_views(9, 0.1 * 8.0, 0.1, 12.0), 9.0);
        assert_eq!(independent_views(9, 0.7 + 0.1, 0.1, 4.0), 4.0);
        assert_eq!(frame_interval_s(&[1.0]), None);
    }
}
