//! Offset between the clocks of a drive and of another sensor.

use std::str::FromStr;

use crate::error::Error;
use crate::text;

/// Standard deviation of a clock offset that was given without one \[s\].
const SIGMA_S: f64 = 2.0;

/// Offset from the clock of a drive to that of a GPS track or a speed record, as it is known beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockOffset {
    /// Offset \[s\].
    pub offset_s: f64,
    /// Its standard deviation \[s\].
    pub sigma_s: f64,
}

impl FromStr for ClockOffset {
    type Err = Error;

    /// `SECONDS` or `SECONDS,SIGMA`.
    fn from_str(value: &str) -> Result<Self, Error> {
        let wrong = || {
            Error::Usage(format!(
                "{value:?}: expected SECONDS or SECONDS,SIGMA with a SIGMA from 0.001 to 3600, as 3.5,0.2"
            ))
        };
        let (offset_s, sigma_s) = match text::numbers(value).ok_or_else(wrong)?[..] {
            [offset] => (offset, SIGMA_S),
            [offset, sigma] => (offset, sigma),
            _ => return Err(wrong()),
        };
        let known = offset_s.abs() <= 1e11 && (1e-3..=3600.0).contains(&sigma_s);
        if known { Ok(Self { offset_s, sigma_s }) } else { Err(wrong()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_read_and_refused() {
        assert_eq!("-3.5".parse::<ClockOffset>().unwrap(), ClockOffset { offset_s: -3.5, sigma_s: 2.0 });
        assert_eq!(
            "1.7e9, 0.2".parse::<ClockOffset>().unwrap(),
            ClockOffset { offset_s: 1.7e9, sigma_s: 0.2 }
        );
        for text in ["", "x", "1,0", "1,-1", "nan", "1,2,3", "inf"] {
            assert!(text.parse::<ClockOffset>().unwrap_err().to_string().contains("SECONDS,SIGMA"), "{text}");
        }
    }
}
