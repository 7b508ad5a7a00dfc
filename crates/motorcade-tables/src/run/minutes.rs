//! Row groups of a minute.

/// A minute \[ns\].
const MINUTE_NS: i64 = 60_000_000_000;

/// Numbers of rows of each minute after `start_ns` that has some; times do not run backwards.
pub(super) fn minutes(start_ns: i64, times_ns: &[i64]) -> Vec<usize> {
    let minute = |time_ns: &i64| time_ns.saturating_sub(start_ns).div_euclid(MINUTE_NS);
    times_ns.chunk_by(|a, b| minute(a) == minute(b)).map(<[i64]>::len).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_start_with_a_minute_of_the_drive() {
        let start = 1_700_000_000_000_000_000;
        let times: Vec<i64> = [0, 30, 59, 60, 61, 200].iter().map(|s| start + s * 1_000_000_000).collect();
        assert_eq!(minutes(start, &times), [3, 2, 1]);
        assert_eq!(minutes(0, &[]), [0; 0]);
    }
}
