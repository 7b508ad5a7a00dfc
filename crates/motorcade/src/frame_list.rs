//! Frames that a warning names.

/// Stretches of frames that are named, at most.
const NAMED: usize = 4;

/// Numbers of frames in order; those that follow each other in the run are one stretch.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct FrameList {
    /// First and last frame of each stretch that is named.
    stretches: Vec<(u64, u64)>,
    /// Stretches that are not.
    more: usize,
    last: Option<u64>,
}

impl FrameList {
    /// Adds a frame, after those before.
    pub fn push(&mut self, number: u64) {
        let follows = self.last.is_some_and(|last| number == last + 1);
        let full = self.stretches.len() == NAMED;
        match self.stretches.last_mut() {
            Some(stretch) if follows && self.more == 0 => stretch.1 = number,
            _ if follows => {}
            _ if !full => self.stretches.push((number, number)),
            _ => self.more += 1,
        }
        self.last = Some(number);
    }

    /// The frames in words, `frames 3, 8 to 12 and 2 more times`; `None` without any.
    pub fn describe(&self) -> Option<String> {
        let &(first, last) = self.stretches.first()?;
        let words =
            self.stretches.iter().map(|(a, b)| if a == b { format!("{a}") } else { format!("{a} to {b}") });
        let named: Vec<String> = words.collect();
        let one = named.len() == 1 && first == last && self.more == 0;
        let more = if self.more > 0 { format!(" and {} more times", self.more) } else { String::new() };
        Some(format!("{} {}{more}", if one { "frame" } else { "frames" }, named.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_are_named_and_the_rest_is_counted() {
        let said = |numbers: &[u64]| {
            let mut list = FrameList::default();
            numbers.iter().for_each(|n| list.push(*n));
            list.describe()
        };
        assert_eq!(said(&[]), None);
        assert_eq!(said(&[7]).unwrap(), "frame 7");
        assert_eq!(said(&[7, 8, 9]).unwrap(), "frames 7 to 9");
        assert_eq!(said(&[7, 9, 10]).unwrap(), "frames 7, 9 to 10");
        assert_eq!(said(&[1, 3, 5, 7, 9, 10, 12]).unwrap(), "frames 1, 3, 5, 7 and 2 more times");
    }
}
