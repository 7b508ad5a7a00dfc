//! Distances by another sensor, as help for the metric scale.

use std::path::Path;

use motorcade_dataset::{ClockOffset, GpsTrack, MeasuredDistance, SpeedRecord};

use crate::error::Result;
use crate::estimator_options::DistanceOptions;

/// Sensor of the distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DistanceSensor {
    /// Speeds of the car: a bus, a wheel sensor.
    Speed,
    /// Positions of a GPS receiver.
    Gps,
}

impl std::fmt::Display for DistanceSensor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Speed => "speeds",
            Self::Gps => "GPS track",
        })
    }
}

/// Distances by a sensor other than the camera. They give metres together with the height of the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Distances {
    /// Sensor of the distances.
    pub sensor: DistanceSensor,
    /// The distances, in order of time.
    pub measured: Vec<MeasuredDistance>,
    /// Offset from the clock of the frames to that of the sensor; `None` where it is not known.
    pub clock: Option<ClockOffset>,
}

impl Distances {
    /// Reads a CSV file of speeds, see [`SpeedRecord::read`].
    ///
    /// # Errors
    /// A file that does not read.
    pub fn of_speeds(path: &Path, clock: Option<ClockOffset>) -> Result<Self> {
        let measured = SpeedRecord::read(path)?.distances();
        Ok(Self { sensor: DistanceSensor::Speed, measured, clock })
    }

    /// Reads a GPS track (GPX, NMEA, CSV), see [`GpsTrack::read`].
    ///
    /// # Errors
    /// A file that does not read.
    pub fn of_track(path: &Path, clock: Option<ClockOffset>) -> Result<Self> {
        let measured = GpsTrack::read(path)?.distances();
        Ok(Self { sensor: DistanceSensor::Gps, measured, clock })
    }

    /// Offset between the clocks, as far as it is known.
    pub(crate) fn clock_offset(&self, options: &DistanceOptions) -> ClockOffset {
        self.clock.unwrap_or(ClockOffset { offset_s: 0.0, sigma_s: options.clock_sigma_s })
    }

    /// Why they cannot belong to frames at these times \[ns\].
    pub(crate) fn problem(&self, timestamps_ns: &[i64], options: &DistanceOptions) -> Option<String> {
        let (first, last) = (self.measured.first(), self.measured.last());
        let Some((first, last)) = first.zip(last) else {
            return Some(format!("the {} determine no distance: too short, or too uncertain", self.sensor));
        };
        let seconds = |ns: Option<&i64>| ns.map_or(0.0, |ns| *ns as f64 * 1e-9);
        let (begin, end) = (seconds(timestamps_ns.first()), seconds(timestamps_ns.last()));
        let ClockOffset { offset_s, sigma_s } = self.clock_offset(options);
        let apart =
            begin + offset_s > last.to_s + 3.0 * sigma_s || end + offset_s < first.from_s - 3.0 * sigma_s;
        apart.then(|| {
            format!(
                "the {} run from {:.1} to {:.1} s, the frames from {begin:.1} to {end:.1} s with a clock offset of {offset_s:.1} s: no \
                 time in common; give the offset with --clock-offset (motorcade export estimates it)",
                self.sensor, first.from_s, last.to_s
            )
        })
    }
}
