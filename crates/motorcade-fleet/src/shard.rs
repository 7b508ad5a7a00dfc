//! A part of a manifest.

use std::fmt;
use std::str::FromStr;

/// Part `index` of `count`: the drives whose number in the manifest, from 0, is `index` modulo `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    index: usize,
    count: usize,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// True when the drive of this number belongs to it.
    pub fn holds(&self, number: usize) -> bool {
        number % self.count == self.index
    }

    /// What is added to names of files: nothing for the whole, else `.<index>-of-<count>`.
    pub fn suffix(&self) -> String {
        if *self == Self::WHOLE { String::new() } else { format!(".{}-of-{}", self.index, self.count) }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("`{text}` is not INDEX/COUNT with INDEX from 0 to COUNT - 1, such as 0/8");
        let (index, count) = text.split_once('/').ok_or_else(expected)?;
        let (index, count) = index.parse().ok().zip(count.parse().ok()).ok_or_else(expected)?;
        if index < count { Ok(Self { index, count }) } else { Err(expected()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_drive_belongs_to_one_shard() {
        for count in [1, 2, 3, 7] {
            let shards: Vec<Shard> = (0..count).map(|k| format!("{k}/{count}").parse().unwrap()).collect();
            for number in 0..50 {
                assert_eq!(shards.iter().filter(|shard| shard.holds(number)).count(), 1);
            }
        }
    }

    #[test]
    fn shards_are_written_index_of_count() {
        let shard: Shard = "2/5".parse().unwrap();
        assert_eq!((shard.to_string().as_str(), shard.suffix().as_str()), ("2/5", ".2-of-5"));
        assert_eq!("0/1".parse::<Shard>().unwrap().suffix(), "");
        for wrong in ["", "1", "5/5", "0/0", "-1/2", "a/b", "1/2/3"] {
            assert!(wrong.parse::<Shard>().unwrap_err().contains("INDEX/COUNT"), "{wrong}");
        }
    }
}
