//! The place of a run on the map.

use motorcade::RecordedRun;
use motorcade_dataset::Geodetic;
use motorcade_dataset::text::numbers;
use motorcade_geometry::{Pose, World};
use nalgebra::{Matrix3, Vector3};

use crate::error::Error;

/// Where the first camera is and where it looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Position of the first camera.
    pub start: Geodetic,
    /// Direction of view of the first camera along the road, clockwise from north \[deg\].
    pub heading_deg: f64,
    /// Standard deviations of position \[m\] and heading \[deg\]; not known of a start that was given.
    pub sigma: Option<(f64, f64)>,
    /// What is added to the times of the run to get seconds since 1970; `None` when they are not known.
    pub clock_offset_s: Option<f64>,
}

impl std::str::FromStr for Anchor {
    type Err = Error;

    /// `LATITUDE,LONGITUDE,HEADING` or with `,ALTITUDE`: degrees, metres.
    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = || {
            Error::Start(format!(
                "{text:?}: expected LATITUDE,LONGITUDE,HEADING[,ALTITUDE] in degrees and metres, as 49.0112,8.4228,270"
            ))
        };
        let (latitude_deg, longitude_deg, heading_deg, altitude_m) = match numbers(text).ok_or_else(wrong)?[..]
        {
            [latitude, longitude, heading] => (latitude, longitude, heading, 0.0),
            [latitude, longitude, heading, altitude] => (latitude, longitude, heading, altitude),
            _ => return Err(wrong()),
        };
        let start = Geodetic { latitude_deg, longitude_deg, altitude_m };
        if !start.is_valid() || !(-360.0..=360.0).contains(&heading_deg) {
            return Err(wrong());
        }
        Ok(Self { start, heading_deg, sigma: None, clock_offset_s: None })
    }
}

impl Anchor {
    /// Rotation of right, forward, up of the first camera into east, north, up.
    pub(crate) fn turn(&self) -> Matrix3<f64> {
        // Clockwise from north.
        let (sin, cos) = self.heading_deg.to_radians().sin_cos();
        Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0)
    }
}

/// A run with its place on the map.
pub struct Placed<'a> {
    /// The run.
    pub run: &'a RecordedRun,
    /// Its place.
    pub anchor: Anchor,
    /// Rotation from the world of the run to east, north, up.
    enu_from_world: Matrix3<f64>,
}

/// Rows right, forward and up of the first camera on the road, in the world of the run.
pub(crate) fn level_axes(run: &RecordedRun) -> Option<Matrix3<f64>> {
    let first = run.frames.first()?;
    let r = first.world_from_camera.rotation_matrix();
    let up = r * first.road_normal;
    let forward = r * Vector3::z();
    let forward = (forward - up * forward.dot(&up)).try_normalize(1e-6)?;
    let right = forward.cross(&up);
    Some(Matrix3::from_rows(&[right.transpose(), forward.transpose(), up.transpose()]))
}

impl<'a> Placed<'a> {
    /// Puts a run in its place; `None` for a run without frames.
    pub fn new(run: &'a RecordedRun, anchor: Anchor) -> Option<Self> {
        Some(Self { run, anchor, enu_from_world: anchor.turn() * level_axes(run)? })
    }

    /// East, north, up of a point of the world, from the first camera \[m\].
    pub(crate) fn local(&self, at: &Vector3<f64>) -> Vector3<f64> {
        let origin =
            self.run.frames.first().map_or_else(Vector3::zeros, |f| f.world_from_camera.translation());
        self.enu_from_world * (at - origin)
    }

    /// The place of a point of the world.
    pub(crate) fn place(&self, at: &Vector3<f64>) -> Geodetic {
        self.anchor.start.moved(&self.local(at))
    }

    /// A direction of a body as east, north, up.
    pub(crate) fn direction<F>(&self, world_from_body: &Pose<World, F>, axis: &Vector3<f64>) -> Vector3<f64> {
        self.enu_from_world * (world_from_body.rotation_matrix() * axis)
    }

    /// Time of a frame in UTC, where it is known.
    pub(crate) fn utc(&self, time_ns: i64) -> Option<String> {
        let seconds = time_ns as f64 * 1e-9 + self.anchor.clock_offset_s?;
        let stamp = jiff::Timestamp::from_microsecond((seconds * 1e6).round() as i64).ok()?;
        Some(format!("{stamp:.3}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_are_read_and_refused() {
        let anchor: Anchor = "49.01, 8.42, 270, 115".parse().unwrap();
        assert_eq!(
            (anchor.start.latitude_deg, anchor.heading_deg, anchor.start.altitude_m),
            (49.01, 270.0, 115.0)
        );
        for text in ["49.01,8.42", "149,8,0", "49,8,x", "49,8,nan", "49,8,400", ""] {
            assert!(
                text.parse::<Anchor>().unwrap_err().to_string().contains("LATITUDE,LONGITUDE,HEADING"),
                "{text}"
            );
        }
    }
}
