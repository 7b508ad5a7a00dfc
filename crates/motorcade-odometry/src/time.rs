//! Time between frames.

/// Interval at which noise figures that are stated per frame were calibrated \[s\]: KITTI's 10 frames/s.
pub(crate) const CALIBRATION_INTERVAL_S: f64 = 0.1;

/// Nanoseconds as seconds. Division, not multiplication by 1e-9, keeps 100 ms exactly 0.1 s.
pub(crate) fn seconds(ns: i64) -> f64 {
    ns as f64 / 1e9
}

/// Seconds as whole nanoseconds.
pub(crate) fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// An interval over the calibration interval; zero where time does not advance. Factor on variances that accumulate with time.
pub(crate) fn calibrated(ns: i64) -> f64 {
    seconds(ns.max(0)) / CALIBRATION_INTERVAL_S
}

/// `a / b` of two intervals, not negative; 1 where `b` is no interval.
pub(crate) fn ratio(a_ns: i64, b_ns: i64) -> f64 {
    if b_ns > 0 { a_ns.max(0) as f64 / b_ns as f64 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_of_a_second_is_exact() {
        assert_eq!(calibrated(100_000_000), 1.0);
        assert_eq!(nanoseconds(0.8), 8 * 100_000_000);
        assert_eq!(ratio(100_000_000, 100_000_000), 1.0);
        assert_eq!(ratio(-5, 100), 0.0);
        assert_eq!(ratio(5, 0), 1.0);
    }
}
