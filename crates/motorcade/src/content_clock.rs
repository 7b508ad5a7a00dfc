//! Times at which the pictures of a video were taken whose rate was raised unevenly.
//!
//! Of 25 pictures a second in a video of 60 some are shown two frames long and others three. A picture is first shown up to one frame of the video after it
//! was taken, so that by the times of the video a car of even speed goes by two thirds of it and by the whole in turn.

use std::collections::VecDeque;

/// Time over which the interval of the pictures is taken \[ns\]: the shorter it is, the sooner a new rate is followed and the more it errs.
const SPAN_NS: i64 = 2_000_000_000;
/// Fewest pictures that tell an interval: it errs by a few per cent of a frame of the video then.
const LEAST_PICTURES: usize = 8;
/// Share of a frame of the video within which a time is that of the video, whose own times are rounded.
const ROUNDING: f64 = 0.02;

/// Follows the pictures that show something new.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct ContentClock {
    /// Times at which new pictures of the last seconds were first shown \[ns\].
    shown_ns: VecDeque<i64>,
    /// Time of the last frame that repeats the one before \[ns\].
    repeated_ns: Option<i64>,
    /// Time at which the last new picture was taken \[ns\].
    taken_ns: i64,
}

impl ContentClock {
    /// Notes a frame that shows the picture before again.
    pub(crate) fn repeats(&mut self, time_ns: i64) {
        self.repeated_ns = Some(time_ns);
    }

    /// Time at which a new picture was taken that is first shown at `shown_ns`, the frame before it at `before_ns`. In a video without repetitions that
    /// is when it is shown.
    pub(crate) fn taken_ns(&mut self, shown_ns: i64, before_ns: i64) -> i64 {
        let old = |time: i64| shown_ns - time > SPAN_NS;
        while self.shown_ns.front().is_some_and(|first| old(*first)) {
            self.shown_ns.pop_front();
        }
        let repeats = self.repeated_ns.is_some_and(|time| !old(time));
        let interval_ns = self.interval_ns().filter(|_| repeats);
        self.shown_ns.push_back(shown_ns);
        let frame_ns = (shown_ns - before_ns) as f64;
        let late_ns = interval_ns.map_or(0.0, |interval| (shown_ns - self.taken_ns) as f64 - interval);
        // It was taken while the frame before was shown, or is shown at once.
        let late_ns =
            if late_ns < ROUNDING * frame_ns { 0.0 } else { late_ns.min((1.0 - ROUNDING) * frame_ns) };
        self.taken_ns = shown_ns - late_ns.round() as i64;
        self.taken_ns
    }

    /// Interval of the pictures: slope of their times by least squares.
    fn interval_ns(&self) -> Option<f64> {
        let (first, count) = (*self.shown_ns.front()?, self.shown_ns.len());
        if count < LEAST_PICTURES {
            return None;
        }
        let middle = 0.5 * (count - 1) as f64;
        let (mut across, mut square) = (0.0, 0.0);
        for (k, shown) in self.shown_ns.iter().enumerate() {
            let from_middle = k as f64 - middle;
            across += from_middle * (shown - first) as f64;
            square += from_middle * from_middle;
        }
        Some(across / square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Intervals \[ms\] at which pictures of `content` a second were taken, by a video of `video` frames a second.
    fn intervals_ms(content: i64, video: i64, frames: i64) -> Vec<f64> {
        let mut clock = ContentClock::default();
        let time_ns = |k: i64| (k * 1_000_000_000 + video / 2) / video;
        let mut taken = Vec::new();
        for k in 0..frames {
            let picture = |k: i64| k * content / video;
            if k > 0 && picture(k) == picture(k - 1) {
                clock.repeats(time_ns(k));
            } else {
                taken.push(clock.taken_ns(time_ns(k), time_ns((k - 1).max(0))));
            }
        }
        taken.windows(2).map(|pair| (pair[1] - pair[0]) as f64 * 1e-6).collect()
    }

    #[test]
    fn pictures_shown_for_two_frames_and_three_were_taken_evenly() {
        for (content, video) in [(25, 60), (10, 25), (25, 30), (24, 60), (15, 50)] {
            let found = intervals_ms(content, video, 6 * video);
            let (even, frame) = (1000.0 / content as f64, 1000.0 / video as f64);
            let uneven = |from: &[f64]| from.iter().map(|ms| (ms - even).abs()).fold(0.0, f64::max);
            assert!(uneven(&found[..6]) > 0.3 * frame, "{content} in {video}: {found:?}");
            assert!(uneven(&found[2 * content as usize..]) < 0.05 * frame, "{content} in {video}: {found:?}");
        }
    }

    #[test]
    fn even_repetitions_and_none_keep_the_times_of_the_video() {
        for (content, video) in [(10, 30), (25, 50), (30, 30)] {
            let even = 1000.0 / content as f64;
            assert!(intervals_ms(content, video, 5 * video).iter().all(|ms| (ms - even).abs() < 1e-5));
        }
    }
}
