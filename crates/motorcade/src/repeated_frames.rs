//! Frames that show the frame before again: ten pictures a second in a video of thirty, or a picture that is frozen for seconds.

use std::ops::Range;

use image::GrayImage;
use motorcade_dataset::Sequence;

use crate::check_options::RepeatedFrameOptions;
use crate::content_clock::ContentClock;

/// Why a frame shows nothing new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Repetition {
    /// Its picture is that of the frame before, as in a video whose rate was raised.
    Repeated,
    /// The picture of a camera that drove did not change.
    Frozen,
}

impl Repetition {
    /// The problem of its frame.
    pub(crate) fn problem(self) -> &'static str {
        match self {
            Self::Repeated => "repeats the frame before",
            Self::Frozen => "the picture is frozen",
        }
    }
}

/// Distinguishes repeated frames from those of a standing camera: the frames around them differ.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct RepeatedFrames {
    #[serde(skip)]
    options: RepeatedFrameOptions,
    last: Vec<u8>,
    last_ns: i64,
    /// Usual difference of two frames that differ \[grey levels\].
    usual: f64,
    /// Difference of the last two frames that differ \[grey levels\].
    newest: f64,
    /// Time of the last frame, repeated or not \[ns\].
    before_ns: i64,
    freezes: bool,
    count: usize,
    frozen: usize,
    frames: usize,
    first_ns: i64,
    first: FirstRun,
    clock: ContentClock,
    /// Time at which the newest frame that repeats none was taken \[ns\].
    taken_ns: i64,
}

/// Frames alike at the start of a drive, before it is known how much two frames differ: a camera that stands, or pictures that repeat.
#[derive(Clone, Copy, serde::Serialize, serde::Deserialize)]
enum FirstRun {
    /// So many frames after the first one differ by this at most \[grey levels\].
    Alike { frames: usize, difference: f64 },
    /// One differed soon after: they repeat the first one if the next frame is a repetition.
    Ended { frames: usize },
    /// They were told apart.
    Known,
}

impl RepeatedFrames {
    pub fn new(options: RepeatedFrameOptions) -> Self {
        Self { options, ..Self::default() }
    }

    /// As after the frame of a state, with the options of this one.
    pub fn resumed(&self, state: Self) -> Self {
        Self { options: self.options, ..state }
    }

    /// Kind of repetition of the last frame that showed something new; `None` of one that does so itself.
    pub fn repetition(&mut self, image: &GrayImage, timestamp_ns: i64) -> Option<Repetition> {
        self.frames += 1;
        let options = &self.options;
        let before_ns = if self.frames == 1 { timestamp_ns } else { self.before_ns };
        let pixels = || image.as_raw().iter().step_by(options.step_px).copied();
        if self.last.len() == pixels().len() {
            let sum: u64 = self.last.iter().zip(pixels()).map(|(a, b)| u64::from(a.abs_diff(b))).sum();
            let difference = sum as f64 / self.last.len().max(1) as f64;
            let interval_s = (timestamp_ns - self.before_ns) as f64 * 1e-9;
            self.before_ns = timestamp_ns;
            let abrupt = interval_s < options.abrupt_s && self.newest > options.motion_share * self.usual;
            self.freezes = difference < options.frozen_share * self.usual
                && self.usual > options.moving_grey
                && (self.freezes || abrupt);
            let lasting = (timestamp_ns - self.last_ns) as f64 >= options.longest_s * 1e9;
            if self.freezes && lasting {
                self.frozen += 1;
                return Some(Repetition::Frozen);
            }
            let near = difference < (options.most_share * self.usual).min(options.most_grey)
                && self.usual > options.moving_grey;
            if near && !lasting {
                self.count += 1;
                self.clock.repeats(timestamp_ns);
                return Some(Repetition::Repeated);
            }
            let since_first_s = (timestamp_ns - self.first_ns) as f64 * 1e-9;
            self.first = self.first.with(difference, since_first_s, options);
            if near {
                // The camera stands.
                self.usual = 0.0;
            }
            self.newest = difference;
            // Against this difference the usual one so far is that of repetitions.
            let anew = self.usual < options.most_share * difference;
            if anew {
                self.clock = ContentClock::default();
            }
            self.usual += (difference - self.usual) * if anew { 1.0 } else { options.rate };
        }
        if self.frames == 1 {
            self.first_ns = timestamp_ns;
        }
        self.last.clear();
        self.last.extend(pixels());
        (self.last_ns, self.before_ns) = (timestamp_ns, timestamp_ns);
        self.taken_ns = self.clock.taken_ns(timestamp_ns, before_ns);
        None
    }

    /// Time at which the picture of the newest frame that repeats none was taken \[ns\]: up to a frame before it is shown, where pictures repeat unevenly.
    pub fn taken_ns(&self) -> i64 {
        self.taken_ns
    }

    /// Rows that repeat the first one, once, where the last frame showed that they do.
    pub fn repeat_the_first(&mut self) -> Range<usize> {
        let FirstRun::Ended { frames } = self.first else { return 0..0 };
        self.first = FirstRun::Known;
        self.count += frames;
        1..1 + frames
    }

    /// The findings in words.
    pub fn describe(&self) -> Vec<String> {
        let Self { count, frozen, frames, .. } = self;
        let repeated = (*count > 0).then(|| {
            format!(
                "{count} of {frames} frames repeat the frame before, as in a video whose rate was raised; their poses are bridged"
            )
        });
        let frozen = (*frozen > 0).then(|| {
            format!("{frozen} of {frames} frames are frozen: the picture of a camera that drove did not change; their poses are bridged")
        });
        repeated.into_iter().chain(frozen).collect()
    }
}

impl Default for FirstRun {
    fn default() -> Self {
        Self::Alike { frames: 0, difference: 0.0 }
    }
}

impl FirstRun {
    /// With the next frame that repeats none.
    fn with(self, difference: f64, since_first_s: f64, options: &RepeatedFrameOptions) -> Self {
        match self {
            Self::Alike { frames, difference: most } if difference <= options.moving_grey => {
                Self::Alike { frames: frames + 1, difference: most.max(difference) }
            }
            Self::Alike { frames, difference: most }
                if frames > 0
                    && most < options.most_share * difference
                    && since_first_s <= options.longest_s =>
            {
                Self::Ended { frames }
            }
            _ => Self::Known,
        }
    }
}

/// Pictures that show the one before again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RepeatedPictures {
    /// Pictures that were looked at, from the first on.
    pub looked_at: usize,
    /// Those that repeat the picture before while the camera drives, as in a video whose rate was raised.
    pub repeated: usize,
    /// Those of a picture that stands although the camera drove.
    pub frozen: usize,
}

/// Looks for repeated pictures among the first `most` of an input. Frames that do not read are left out.
pub fn repeated_pictures(
    sequence: &Sequence,
    most: usize,
    options: &RepeatedFrameOptions,
) -> RepeatedPictures {
    let mut frames = RepeatedFrames::new(*options);
    for frame in sequence.frames().take(most).flatten() {
        let _counted = frames.repetition(&frame.gray(), frame.timestamp_ns);
    }
    RepeatedPictures { looked_at: frames.frames, repeated: frames.count, frozen: frames.frozen }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(shift: u32, noise: u32) -> GrayImage {
        GrayImage::from_fn(60, 40, |x, y| {
            let texture = ((x + shift) * 37 + y * 11) % 97;
            image::Luma([(texture + u32::from((x * 7 + y * 13) % 29 == 0) * noise) as u8])
        })
    }

    #[test]
    fn every_third_picture_of_a_raised_rate_is_new() {
        let mut repeated = RepeatedFrames::default();
        let found: Vec<bool> = (0..30)
            .map(|k| repeated.repetition(&picture(k / 3, 5 * (k % 3)), i64::from(k) * 33_000_000).is_some())
            .collect();
        for (k, found) in found.iter().enumerate().skip(4) {
            assert_eq!(*found, k % 3 != 0, "frame {k}");
        }
        assert!(repeated.describe()[0].contains("of 30 frames"));
    }

    #[test]
    fn the_first_repetitions_are_known_once_the_rate_is() {
        let first = |frames: u32, shown: &dyn Fn(u32) -> u32| -> Vec<(u32, Range<usize>)> {
            let mut repeated = RepeatedFrames::default();
            let mut found = Vec::new();
            for k in 0..frames {
                if repeated.repetition(&picture(shown(k), 3 * (k % 3)), i64::from(k) * 33_000_000).is_some() {
                    let rows = repeated.repeat_the_first();
                    found.extend((!rows.is_empty()).then_some((k, rows)));
                }
            }
            found
        };
        assert_eq!(first(30, &|k| k / 3), [(4, 1..3)]);
        assert_eq!(first(30, &|k| (k + 1) / 3), [(3, 1..2)]);
        // A camera that stood, and a rate that was not raised.
        assert_eq!(first(60, &|k| k.saturating_sub(30) / 3), []);
        assert_eq!(first(30, &|k| k.saturating_sub(2)), []);
        assert_eq!(first(30, &|k| k), []);
    }

    /// A smooth road, where new pictures differ by a few grey levels in the mean, and every other one is shown again.
    #[test]
    fn repetitions_are_found_where_new_pictures_differ_little() {
        let smooth = |shift: u32, noise: u32| {
            GrayImage::from_fn(120, 80, |x, y| {
                let mark = (x + 5 * shift) % 40 < 2 && y % 8 < 4;
                image::Luma([90 + 70 * u8::from(mark) + u8::from((x * 7 + y * 13) % 29 == 0) * noise as u8])
            })
        };
        let mut repeated = RepeatedFrames::default();
        let found: Vec<bool> = (0..40)
            .map(|k| repeated.repetition(&smooth(k / 2, k % 2), i64::from(k) * 20_000_000).is_some())
            .collect();
        for (k, found) in found.iter().enumerate().skip(3) {
            assert_eq!(*found, k % 2 == 1, "frame {k}");
        }
    }

    /// A picture of a camera that moves evenly, then brakes within a second and stands; its sensor has noise.
    fn braking(k: u32) -> GrayImage {
        let tenths = if k < 20 { 10 * k } else { 200 + (0..k.min(40) - 20).map(|i| 10 - i / 2).sum::<u32>() };
        let mut image = picture(tenths / 10, 0);
        for (i, pixel) in image.pixels_mut().enumerate() {
            pixel.0[0] += ((i as u32 * 31 + k * 17) % 5) as u8;
        }
        image
    }

    #[test]
    fn a_camera_that_stands_is_not_repeated_for_longer_than_a_moment() {
        let mut repeated = RepeatedFrames::default();
        let found: Vec<bool> =
            (0..80).map(|k| repeated.repetition(&braking(k), i64::from(k) * 50_000_000).is_some()).collect();
        assert!(found[..20].iter().all(|f| !f), "{found:?}");
        assert!(found[50..].iter().filter(|f| **f).count() < 10, "{found:?}");
        assert!(repeated.describe().iter().all(|text| !text.contains("frozen")));
    }

    #[test]
    fn a_picture_that_freezes_in_full_motion_is_frozen() {
        let mut repeated = RepeatedFrames::default();
        let shown = |k: u32| if (20..60).contains(&k) { 19 } else { k };
        let found: Vec<bool> = (0..80)
            .map(|k| repeated.repetition(&picture(shown(k), 0), i64::from(k) * 50_000_000).is_some())
            .collect();
        assert!(found[..20].iter().chain(&found[60..]).all(|f| !f), "{found:?}");
        assert!(found[20..60].iter().all(|f| *f), "{found:?}");
        assert!(repeated.describe().iter().any(|text| text.contains("of 80 frames are frozen")));
    }
}
