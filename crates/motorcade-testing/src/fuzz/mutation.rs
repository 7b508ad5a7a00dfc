//! Damage to a valid file, as hands, editors, other programs, disks and attackers do it.

use proptest::collection::vec;
use proptest::prelude::{Strategy, any};
use proptest::sample::Index;

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

/// A change of a file. Numbers shrink towards a change that does least.
#[derive(Clone, Debug)]
pub struct Change {
    kind: u8,
    at: Index,
    from: Index,
    word: Index,
    length: usize,
    byte: u8,
}

/// Changes of a file.
pub fn changes() -> impl Strategy<Value = Vec<Change>> {
    let one = (0..9_u8, any::<Index>(), any::<Index>(), any::<Index>(), 0..60_usize, any::<u8>());
    let one =
        one.prop_map(|(kind, at, from, word, length, byte)| Change { kind, at, from, word, length, byte });
    vec(one, 1..=MOST_CHANGES)
}

/// The sample with its changes.
pub fn damaged(sample: &[u8], changes: &[Change]) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for change in changes {
        change.apply(&mut bytes);
        bytes.truncate(LARGEST);
    }
    bytes
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let at = self.at.index(bytes.len() + 1);
        let word = *self.word.get(&WORDS);
        match self.kind {
            0 => {
                bytes.splice(at..at, word.bytes());
            }
            1 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << (self.byte % 8);
                }
            }
            2 => bytes.insert(at, self.byte),
            3 | 4 => {
                // A word in place of another.
                let old = around(bytes, at, |b| b.is_ascii_whitespace() || b",:;[]{}=\"".contains(b));
                bytes.splice(old, word.bytes());
            }
            5 => {
                // A line goes, or comes twice.
                let line = around(bytes, at, |b| *b == b'\n');
                let mut copy = bytes[line.clone()].to_vec();
                copy.push(b'\n');
                let twice = self.byte.is_multiple_of(2);
                bytes.splice(line, if twice { [copy.clone(), copy].concat() } else { Vec::new() });
            }
            6 => {
                let end = (at + self.length).min(bytes.len());
                bytes.drain(at..end);
            }
            7 => {
                // A part of the file at another place.
                let from = self.from.index(bytes.len() + 1);
                let part = bytes[from..(from + self.length).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
            _ => bytes.truncate(at),
        }
    }
}

/// The stretch around a place that holds no separator.
fn around(bytes: &[u8], at: usize, separates: impl Fn(&u8) -> bool) -> std::ops::Range<usize> {
    let start = bytes[..at].iter().rposition(&separates).map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(&separates).map_or(bytes.len(), |k| at + k);
    start..end
}
