//! Readers on damaged files: an answer or an error, in time, never a panic. Inputs are changes of valid samples (strategies of `proptest`), each
//! by its number, so that a failure comes again; of one that fails the smallest is shown.
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

use cpu_time::ThreadTime;
use mutation::{Change, changes, damaged};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Longest time of one input, of the processor: other programs may have it meanwhile. A file of 64 kB takes a thousandth of it.
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
    let try_one = |file: &str, bytes: &[u8]| -> Result<bool, String> {
        let path = folder.path().join(file);
        std::fs::write(&path, bytes).unwrap();
        let start = ThreadTime::now();
        let accepted = catch_unwind(AssertUnwindSafe(|| reader(&path))).map_err(|_| "a panic".to_owned())?;
        let took = start.elapsed();
        if took < LONGEST { Ok(accepted) } else { Err(format!("{took:?}")) }
    };
    for (file, bytes) in samples {
        assert_eq!(try_one(file, bytes), Ok(true), "{name}: the sample {file} is not accepted");
    }
    for (file, bytes) in found {
        let outcome = try_one(file, bytes);
        assert!(outcome.is_ok(), "{name}: {outcome:?} on the input {file} that was found before");
    }
    let strategy = (0..samples.len(), changes());
    let try_damaged = |(sample, changes): &(usize, Vec<Change>)| {
        let (file, bytes) = samples[*sample];
        try_one(file, &damaged(bytes, changes))
    };
    let first: u64 = number("MOTORCADE_FUZZ_FIRST", 0);
    let (mut inputs, mut accepted) = (0_u64, 0_u64);
    while inputs < most && Instant::now() < end {
        let seed = first + inputs;
        let mut tree = strategy.new_tree(&mut runner(seed)).unwrap();
        match try_damaged(&tree.current()) {
            Ok(is_accepted) => accepted += u64::from(is_accepted),
            Err(problem) => {
                let (sample, changes) = smallest(&mut tree, |input| try_damaged(input).is_err());
                let (file, bytes) = samples[sample];
                let shown = damaged(bytes, &changes);
                panic!("{name}: {problem} on input {seed}, {file}: {:?}", String::from_utf8_lossy(&shown));
            }
        }
        inputs += 1;
    }
    println!("{name}: {inputs} inputs, {accepted} accepted, {:.0} s", begin.elapsed().as_secs_f64());
}

/// A source of the input with this number.
fn runner(seed: u64) -> TestRunner {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let config = Config { failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &bytes))
}

/// The smallest input that still fails.
fn smallest<T: ValueTree>(tree: &mut T, fails: impl Fn(&T::Value) -> bool) -> T::Value {
    let mut found = tree.current();
    let mut goes_on = tree.simplify();
    while goes_on {
        let input = tree.current();
        goes_on = if fails(&input) {
            found = input;
            tree.simplify()
        } else {
            tree.complicate()
        };
    }
    found
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "a panic on input")]
    fn a_reader_that_panics_is_found() {
        let reader = |path: &Path| std::fs::read(path).unwrap().len() == 4 || panic!("another length");
        fuzz("a reader", &[("a.txt", b"1 2\n")], &[], reader);
    }

    #[test]
    fn of_an_input_that_fails_the_smallest_is_shown() {
        let fails = |changes: &Vec<Change>| damaged(b"speed = 3\n", changes).contains(&b'#');
        let strategy = changes();
        let mut trees = (0..).map(|seed| strategy.new_tree(&mut runner(seed)).unwrap());
        let mut tree = trees.find(|tree| tree.current().len() > 2 && fails(&tree.current())).unwrap();
        let found = smallest(&mut tree, fails);
        assert!(found.len() == 1 && fails(&found), "{found:?}");
    }

    #[test]
    fn an_input_is_the_same_again() {
        let input =
            |seed: u64| damaged(b"a b c\nd e f\n", &changes().new_tree(&mut runner(seed)).unwrap().current());
        let inputs: Vec<Vec<u8>> = (0..50).map(input).collect();
        assert!((0..50).all(|seed| input(seed) == inputs[seed as usize]));
        assert!(inputs.windows(2).filter(|w| w[0] != w[1]).count() > 40);
    }
}
