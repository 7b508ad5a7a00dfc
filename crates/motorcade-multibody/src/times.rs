//! Times of the frames of a window.

/// Times of consecutive frames \[s\], and the intervals between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameTimes<'a> {
    times_s: &'a [f64],
    /// Interval of a window of one frame \[s\].
    alone_s: f64,
}

/// Shortest interval \[s\]: frames with the same timestamp, as some recorders write them.
const SHORTEST_S: f64 = 1e-3;

impl<'a> FrameTimes<'a> {
    pub(crate) fn new(times_s: &'a [f64], alone_s: f64) -> Self {
        Self { times_s, alone_s }
    }

    /// Time from frame `a` to frame `b` \[s\], to the nanosecond: differences of large numbers are otherwise not the same from
    /// frame to frame.
    pub(crate) fn between(&self, a: usize, b: usize) -> f64 {
        match (self.times_s.get(a), self.times_s.get(b)) {
            (Some(a), Some(b)) => (((b - a) * 1e9).round() / 1e9).max(SHORTEST_S),
            _ => self.alone_s,
        }
    }

    /// Mean interval between frames \[s\].
    pub(crate) fn mean_interval(&self) -> f64 {
        match self.times_s {
            [first, .., last] => {
                let mean = (last - first) / (self.times_s.len() - 1) as f64;
                ((mean * 1e9).round() / 1e9).max(SHORTEST_S)
            }
            _ => self.alone_s,
        }
    }

    /// Time to frame `k` from the one before \[s\]; of the first frame, to the one after.
    pub(crate) fn interval(&self, k: usize) -> f64 {
        let first = k.saturating_sub(1);
        self.between(first, first + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_intervals_are_equal_to_the_last_bit() {
        let times: Vec<f64> = (0..1000).map(|k| 1234.5 + f64::from(k) * 0.1).collect();
        let times = FrameTimes::new(&times, 0.1);
        assert!((0..1000).all(|k| times.interval(k) == 0.1));
        assert_eq!((times.between(3, 5), times.mean_interval()), (0.2, 0.1));
        assert_eq!(FrameTimes::new(&[7.0], 0.1).interval(0), 0.1);
        assert_eq!(FrameTimes::new(&[7.0, 7.0], 0.1).interval(1), SHORTEST_S);
    }
}
