//! Ranges of frames.

use std::fmt;
use std::str::FromStr;

/// A range of the input's own frame numbers: `A..B` (without B), `A..=B` (with B), `A..`, `..B`, `..`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct FrameRange {
    /// First number.
    pub start: Option<u64>,
    /// First number after the range.
    pub end: Option<u64>,
}

impl FrameRange {
    /// True for numbers in the range.
    pub fn contains(&self, number: u64) -> bool {
        self.start.is_none_or(|start| number >= start) && self.end.is_none_or(|end| number < end)
    }
}

/// Text that is not a range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{0}` is not a range of frames; write A..B (without B), A..=B (with B), A.. or ..B")]
pub struct InvalidRange(String);

impl FromStr for FrameRange {
    type Err = InvalidRange;
    fn from_str(text: &str) -> Result<Self, InvalidRange> {
        let invalid = || InvalidRange(text.to_owned());
        let (start, end) = text.split_once("..").ok_or_else(invalid)?;
        let number = |s: &str| match s.trim() {
            "" => Ok(None),
            s => s.parse::<u64>().map(Some).map_err(|_| invalid()),
        };
        let start = number(start)?;
        let end = match end.strip_prefix('=') {
            Some(last) => Some(number(last)?.and_then(|n| n.checked_add(1)).ok_or_else(invalid)?),
            None => number(end)?,
        };
        if start.zip(end).is_some_and(|(start, end)| start >= end) {
            return Err(invalid());
        }
        Ok(Self { start, end })
    }
}

impl TryFrom<String> for FrameRange {
    type Error = InvalidRange;
    fn try_from(text: String) -> Result<Self, InvalidRange> {
        text.parse()
    }
}

impl From<FrameRange> for String {
    fn from(range: FrameRange) -> Self {
        range.to_string()
    }
}

impl fmt::Display for FrameRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(start) = self.start {
            write!(f, "{start}")?;
        }
        write!(f, "..")?;
        self.end.map_or(Ok(()), |end| write!(f, "{end}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_read_and_print() {
        for (text, yes, no) in [("16..101", 100, 101), ("16..=100", 100, 101), ("..5", 4, 5), ("5..", 5, 4)] {
            let range: FrameRange = text.parse().unwrap();
            assert!(range.contains(yes) && !range.contains(no), "{text}");
            assert_eq!(range.to_string().parse::<FrameRange>(), Ok(range));
        }
        for text in ["", "7", "9..3", "a..b", "3..=", "4..4"] {
            assert!(text.parse::<FrameRange>().is_err(), "{text}");
        }
    }
}
