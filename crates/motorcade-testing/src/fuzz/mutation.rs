//! Damage to a valid file, as hands, editors, other programs, disks and attackers do it.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Words that readers of numbers and names trip over.
const WORDS: [&str; 26] = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-308",
    "0",
    "-0",
    "-1",
    "1",
    "2147483648",
    "99999999999999999999",
    "",
    " ",
    "1,5",
    "0x10",
    "é",
    "\u{feff}",
    "\u{0}",
    "\"",
    "[",
    "{",
    "}",
    "=",
    "#",
    "\r",
];
/// Most changes of one input.
const MOST_CHANGES: usize = 6;
/// Largest input \[bytes\]: readers that are linear in it take as long as on a valid file.
const LARGEST: usize = 1 << 16;

/// The sample with some changes.
pub fn damaged(sample: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for _ in 0..rng.random_range(1..=MOST_CHANGES) {
        change(&mut bytes, rng);
        bytes.truncate(LARGEST);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let at = rng.random_range(0..=bytes.len());
    match rng.random_range(0..9) {
        0 => bytes.truncate(at),
        1 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << rng.random_range(0..8);
            }
        }
        2 => bytes.insert(at, rng.random()),
        3 => {
            bytes.splice(at..at, WORDS[rng.random_range(0..WORDS.len())].bytes());
        }
        4 | 5 => {
            // A word in place of another.
            let word = around(bytes, at, |b| b.is_ascii_whitespace() || b",:;[]{}=\"".contains(b));
            bytes.splice(word, WORDS[rng.random_range(0..WORDS.len())].bytes());
        }
        6 => {
            // A line goes, or comes twice.
            let line = around(bytes, at, |b| *b == b'\n');
            let mut copy = bytes[line.clone()].to_vec();
            copy.push(b'\n');
            let twice = rng.random();
            bytes.splice(line.clone(), if twice { [copy.clone(), copy].concat() } else { Vec::new() });
        }
        7 => {
            let end = (at + rng.random_range(0..40)).min(bytes.len());
            bytes.drain(at..end);
        }
        _ => {
            // A part of the file at another place.
            let from = rng.random_range(0..=bytes.len());
            let part = bytes[from..(from + rng.random_range(0..60)).min(bytes.len())].to_vec();
            bytes.splice(at..at, part);
        }
    }
}

/// The stretch around a place that holds no separator.
fn around(bytes: &[u8], at: usize, separates: impl Fn(&u8) -> bool) -> std::ops::Range<usize> {
    let start = bytes[..at].iter().rposition(&separates).map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(&separates).map_or(bytes.len(), |k| at + k);
    start..end
}
