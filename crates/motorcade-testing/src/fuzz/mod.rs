//! Readers on damaged files: an answer or an error, in time, never a panic. Every input follows from a seed, so that a failure comes again.
//!
//! `MOTORCADE_FUZZ_SECONDS` is the time of each reader (a third of a second by default), `MOTORCADE_FUZZ_INPUTS` the number of inputs after which it ends
//! earlier, `MOTORCADE_FUZZ_FIRST` the number of the first one, `MOTORCADE_FUZZ_ONLY` the one reader that gets any.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a part of tests may fail loudly, and says what it did"
)]

mod mutation;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::str::FromStr;
use std::time::{Duration, Instant};

use mutation::damaged;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Longest time of one input; a file of 64 kB takes a thousandth of it.
const LONGEST: Duration = Duration::from_secs(2);

/// A folder in memory where there is one: millions of files are written.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

/// A number of the environment.
fn number<T: FromStr>(name: &str, default: T) -> T {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Gives `reader` damaged versions of the samples, as files of these names, and every input of `found`, which failed once. It answers whether it
/// accepted the file; samples have to be.
pub fn fuzz(name: &str, samples: &[(&str, &[u8])], found: &[(&str, &[u8])], reader: impl Fn(&Path) -> bool) {
    if std::env::var("MOTORCADE_FUZZ_ONLY").is_ok_and(|only| only != name) {
        return;
    }
    let folder = folder();
    let begin = Instant::now();
    let end = begin + Duration::from_secs_f64(number("MOTORCADE_FUZZ_SECONDS", 0.33));
    let most = number("MOTORCADE_FUZZ_INPUTS", u64::MAX);
    for (file, _) in samples.iter().chain(found) {
        std::fs::create_dir_all(folder.path().join(file).parent().unwrap()).unwrap();
    }
    let try_one = |file: &str, bytes: &[u8], which: &str| {
        let path = folder.path().join(file);
        std::fs::write(&path, bytes).unwrap();
        let shown = || String::from_utf8_lossy(bytes).into_owned();
        let once = || {
            let start = Instant::now();
            let outcome = catch_unwind(AssertUnwindSafe(|| reader(&path)));
            let accepted = outcome.unwrap_or_else(|_| panic!("{name}: panic on {which}: {:?}", shown()));
            (accepted, start.elapsed())
        };
        let (accepted, first) = once();
        // Other processes may have had the processor: a slow input is slow again.
        let took = if first < LONGEST { first } else { once().1 };
        assert!(took < LONGEST, "{name}: {took:?} on {which}: {:?}", shown());
        accepted
    };
    for (file, bytes) in samples {
        assert!(try_one(file, bytes, "the sample"), "{name}: the sample {file} is not accepted");
    }
    for (file, bytes) in found {
        try_one(file, bytes, "an input found before");
    }
    let first: u64 = number("MOTORCADE_FUZZ_FIRST", 0);
    let (mut inputs, mut accepted) = (0_u64, 0_u64);
    while inputs < most && Instant::now() < end {
        let seed = first + inputs;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (file, sample) = samples[seed as usize % samples.len()];
        accepted += u64::from(try_one(file, &damaged(sample, &mut rng), &format!("input {seed}")));
        inputs += 1;
    }
    println!("{name}: {inputs} inputs, {accepted} accepted, {:.0} s", begin.elapsed().as_secs_f64());
}

/// Samples of text.
pub fn texts<'a>(samples: &'a [(&'a str, &'a str)]) -> Vec<(&'a str, &'a [u8])> {
    samples.iter().map(|(file, text)| (*file, text.as_bytes())).collect()
}

/// Whole files beside the one that was damaged, for readers of a folder.
pub fn beside(damaged: &Path, whole: &[(&str, &[u8])]) {
    let folder = damaged.parent().unwrap();
    for (name, bytes) in whole.iter().filter(|(name, _)| !damaged.ends_with(name)) {
        let path = folder.join(name);
        if std::fs::read(&path).ok().as_deref() != Some(bytes) {
            std::fs::write(&path, bytes).unwrap();
        }
    }
}
