//! Tracks of a GPS receiver: GPX 1.1, NMEA 0183, CSV.

use std::path::Path;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::distances::MeasuredDistance;
use crate::error::{Error, Result};
use crate::geodesy::Geodetic;
use crate::regular_file;

/// Standard deviation of a receiver in a car where the file does not give it \[m\].
const SIGMA_M: f64 = 4.0;

/// Distances have at least this many standard deviations: their logarithm is then as certain as a tenth.
const LEAST_SIGMAS: f64 = 10.0;
/// Share of the drive and length \[m\] that distances reach where they can: long ones are measured better, short ones follow a
/// scale that drifts.
const SHARE: f64 = 0.24;
const LENGTH_M: f64 = 300.0;
/// Longest time of a distance \[s\].
const LONGEST_S: f64 = 60.0;

/// A fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Seconds since 1970, or since another start that all points share.
    pub time_s: f64,
    /// Position; altitude 0 where the file has none.
    pub at: Geodetic,
    /// Standard deviation of the horizontal position \[m\], each axis.
    pub sigma_m: f64,
}

/// Fixes in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GpsTrack {
    /// The fixes.
    pub points: Vec<TrackPoint>,
}

impl GpsTrack {
    /// Reads a track; its form by the name: `.gpx`, `.nmea`, `.csv` (columns `time`, `latitude`, `longitude`, optionally `altitude`
    /// and `sigma_m`; `time` in seconds or as RFC 3339).
    ///
    /// # Errors
    /// A file that does not read, with its line; fewer than two points; times that do not increase.
    pub fn read(path: &Path) -> Result<Self> {
        let text = regular_file::read_to_string(path).map_err(Error::io(path))?;
        let wrong =
            |(line, problem): (usize, String)| Error::AtLine { path: path.to_path_buf(), line, problem };
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let points = match extension.as_str() {
            "gpx" => gpx(&text),
            "nmea" | "nma" => nmea(&text),
            "csv" => csv(&text),
            _ => Err((1, "expected a file named .gpx, .nmea or .csv".to_owned())),
        };
        let numbered = points.map_err(wrong)?;
        for pair in numbered.windows(2) {
            if pair[1].1.time_s <= pair[0].1.time_s {
                return Err(wrong((pair[1].0, "expected a time after that of the point before".into())));
            }
        }
        if let Some((line, _)) =
            numbered.iter().find(|(_, p)| !(p.at.is_valid() && p.sigma_m > 0.0 && p.sigma_m < 1e4))
        {
            return Err(wrong((
                *line,
                "latitude, longitude, altitude or standard deviation out of range".into(),
            )));
        }
        if numbered.len() < 2 {
            return Err(wrong((
                1,
                format!("{} points with time and position; expected two or more", numbered.len()),
            )));
        }
        Ok(Self { points: numbered.into_iter().map(|(_, p)| p).collect() })
    }

    /// Straight horizontal distances between fixes, one after the other.
    pub fn distances(&self) -> Vec<MeasuredDistance> {
        let between = |a: &TrackPoint, b: &TrackPoint| a.at.local(&b.at).xy().norm();
        let whole: f64 = self.points.windows(2).map(|pair| between(&pair[0], &pair[1])).sum();
        let length_m = LENGTH_M.min(SHARE * whole);
        let (mut out, mut begin) = (Vec::new(), 0);
        for (k, point) in self.points.iter().enumerate() {
            while point.time_s - self.points[begin].time_s > LONGEST_S {
                begin += 1;
            }
            let from = &self.points[begin];
            let (metres, sigma_m) = (between(from, point), from.sigma_m.hypot(point.sigma_m));
            if metres >= (LEAST_SIGMAS * sigma_m).max(length_m) && metres > 0.0 {
                let (from_s, to_s) = (from.time_s, point.time_s);
                out.push(MeasuredDistance { from_s, to_s, metres, sigma_m, straight: true });
                begin = k;
            }
        }
        out
    }
}

/// Points with their lines; a problem with its line.
type Parsed = std::result::Result<Vec<(usize, TrackPoint)>, (usize, String)>;

pub(crate) fn utc(text: &str) -> std::result::Result<f64, String> {
    let stamp = text.trim().parse::<jiff::Timestamp>();
    stamp.map(|t| t.as_microsecond() as f64 * 1e-6).map_err(|e| format!("time {text:?}: {e}"))
}

pub(crate) fn number(text: &str, name: &str) -> std::result::Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    value.ok_or_else(|| format!("{name} {text:?}: expected a number"))
}

/// Points of tracks and routes with a time.
fn gpx(text: &str) -> Parsed {
    let mut reader = Reader::from_str(text);
    let (mut out, mut point, mut element) = (Vec::new(), None::<(usize, TrackPoint, bool)>, Vec::new());
    loop {
        let line = 1 + text
            .as_bytes()
            .iter()
            .take(reader.buffer_position() as usize)
            .filter(|b| **b == b'\n')
            .count();
        let wrong = |problem: String| (line, problem);
        match reader.read_event().map_err(|e| wrong(e.to_string()))? {
            Event::Eof => return Ok(out),
            Event::Start(start) if matches!(start.local_name().as_ref(), b"trkpt" | b"rtept") => {
                let degrees = |name: &str| attribute(&start, name).map_err(wrong);
                let at = Geodetic {
                    latitude_deg: degrees("lat")?,
                    longitude_deg: degrees("lon")?,
                    altitude_m: 0.0,
                };
                point = Some((line, TrackPoint { time_s: 0.0, at, sigma_m: SIGMA_M }, false));
            }
            Event::Start(start) => element = start.local_name().as_ref().to_vec(),
            Event::Text(content) => {
                let content = content.decode().map_err(|e| wrong(e.to_string()))?;
                if let (Some((_, point, timed)), false) = (point.as_mut(), content.trim().is_empty()) {
                    match element.as_slice() {
                        b"ele" => point.at.altitude_m = number(&content, "ele").map_err(wrong)?,
                        b"time" => (point.time_s, *timed) = (utc(&content).map_err(wrong)?, true),
                        // A horizontal dilution of 1 is about the receiver's own deviation.
                        b"hdop" => {
                            point.sigma_m = SIGMA_M * number(&content, "hdop").map_err(wrong)?.max(0.5)
                        }
                        _ => {}
                    }
                }
            }
            Event::End(end) => {
                element.clear();
                if matches!(end.local_name().as_ref(), b"trkpt" | b"rtept")
                    && let Some((line, point, timed)) = point.take()
                {
                    if !timed {
                        return Err((
                            line,
                            "a point without <time>; points are aligned by their times".into(),
                        ));
                    }
                    out.push((line, point));
                }
            }
            _ => {}
        }
    }
}

fn attribute(start: &BytesStart<'_>, name: &str) -> std::result::Result<f64, String> {
    let found = start.try_get_attribute(name).map_err(|e| e.to_string())?;
    let value = found.ok_or_else(|| format!("a point without {name}"))?;
    number(&String::from_utf8_lossy(&value.value), name)
}

/// Sentences RMC, which carry date and time; others are passed over. Sentences with a wrong checksum are refused.
fn nmea(text: &str) -> Parsed {
    let mut out: Vec<(usize, TrackPoint)> = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let wrong = |problem: String| (k + 1, problem);
        let Some(body) = line.trim().strip_prefix('$') else { continue };
        let (body, sum) = body.split_once('*').unwrap_or((body, ""));
        let found = body.bytes().fold(0, |sum, byte| sum ^ byte);
        if !sum.is_empty() && u8::from_str_radix(sum.trim(), 16) != Ok(found) {
            return Err(wrong(format!("checksum {sum}, expected {found:02X}")));
        }
        let cells: Vec<&str> = body.split(',').collect();
        let [kind, time, status, lat, north, lon, east, _, _, date, ..] = cells[..] else { continue };
        if !kind.ends_with("RMC") || status != "A" {
            continue;
        }
        let two = |text: &str, at: usize| text.get(at..at + 2).unwrap_or("").to_owned();
        let stamp = format!(
            "20{}-{}-{}T{}:{}:{}Z",
            two(date, 4),
            two(date, 2),
            two(date, 0),
            two(time, 0),
            two(time, 2),
            time.get(4..).unwrap_or("")
        );
        let angle =
            |text: &str, digits: usize, positive: bool| -> std::result::Result<f64, (usize, String)> {
                let (degrees, minutes) = text.split_at_checked(digits).unwrap_or((text, ""));
                let value = number(degrees, "degrees").map_err(wrong)?
                    + number(minutes, "minutes").map_err(wrong)? / 60.0;
                Ok(if positive { value } else { -value })
            };
        let at = Geodetic {
            latitude_deg: angle(lat, 2, north == "N")?,
            longitude_deg: angle(lon, 3, east == "E")?,
            altitude_m: 0.0,
        };
        out.push((k + 1, TrackPoint { time_s: utc(&stamp).map_err(wrong)?, at, sigma_m: SIGMA_M }));
    }
    Ok(out)
}

fn csv(text: &str) -> Parsed {
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let head = table.headers().map_err(|e| (1, e.to_string()))?.clone();
    let column = |name: &str| head.iter().position(|h| h.eq_ignore_ascii_case(name));
    let needed = |name: &str| column(name).ok_or_else(|| (1, format!("expected a column {name}")));
    let (time, lat, lon) = (needed("time")?, needed("latitude")?, needed("longitude")?);
    let (altitude, sigma) = (column("altitude"), column("sigma_m"));
    let mut out = Vec::new();
    for (k, record) in table.records().enumerate() {
        let record = record.map_err(|e| (k + 2, e.to_string()))?;
        let wrong = |problem: String| (k + 2, problem);
        let cell = |column: usize| record.get(column).unwrap_or("");
        let read = |column: usize, name: &str| number(cell(column), name).map_err(wrong);
        let maybe = |column: Option<usize>, name: &str, default: f64| match column {
            Some(column) if !cell(column).is_empty() => read(column, name),
            _ => Ok(default),
        };
        let at = Geodetic {
            latitude_deg: read(lat, "latitude")?,
            longitude_deg: read(lon, "longitude")?,
            altitude_m: maybe(altitude, "altitude", 0.0)?,
        };
        let time_s = number(cell(time), "time").or_else(|_| utc(cell(time))).map_err(wrong)?;
        out.push((k + 2, TrackPoint { time_s, at, sigma_m: maybe(sigma, "sigma_m", SIGMA_M)? }));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &str) -> Result<GpsTrack> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        GpsTrack::read(&path)
    }

    const GPX: &str = "<?xml version=\"1.0\"?>\n<gpx version=\"1.1\"><trk><trkseg>\n\
        <trkpt lat=\"49.0\" lon=\"8.4\"><ele>115</ele><time>2024-05-01T10:00:00Z</time></trkpt>\n\
        <trkpt lat=\"49.0001\" lon=\"8.4\"><time>2024-05-01T10:00:01.5Z</time><hdop>2</hdop></trkpt>\n\
        </trkseg></trk></gpx>\n";

    #[test]
    fn the_three_forms_are_read() {
        let track = read("a.gpx", GPX).unwrap();
        assert_eq!((track.points[0].at.altitude_m, track.points[0].time_s), (115.0, 1_714_557_600.0));
        assert_eq!((track.points[1].sigma_m, track.points[1].time_s), (8.0, 1_714_557_601.5));
        let nmea = "$GPRMC,100000.00,A,4900.000,N,00824.000,E,10.0,0.0,010524,,,A*66\n$GPGSV,x\n\
            $GPRMC,100001.00,A,4900.006,N,00824.000,W,10.0,0.0,010524,,,A\n";
        let sum = nmea[1..].split('*').next().unwrap().bytes().fold(0, |sum, byte| sum ^ byte);
        let track = read("a.nmea", &nmea.replace("*66", &format!("*{sum:02X}"))).unwrap();
        assert_eq!((track.points[0].time_s, track.points[0].at.longitude_deg), (1_714_557_600.0, 8.4));
        assert!(
            (track.points[1].at.latitude_deg - 49.0001).abs() < 1e-9
                && track.points[1].at.longitude_deg == -8.4
        );
        let track = read("a.csv", "time,latitude,longitude,sigma_m\n0.5,49,8,1.5\n1.5,49.1,8,\n").unwrap();
        assert_eq!((track.points[0].sigma_m, track.points[1].sigma_m), (1.5, SIGMA_M));
    }

    #[test]
    fn fixes_become_straight_distances() {
        // 10 m a second to the north, then standing.
        let start = Geodetic { latitude_deg: 49.0, longitude_deg: 8.0, altitude_m: 0.0 };
        let at = |k: u32| start.moved(&nalgebra::Vector3::new(0.0, 10.0 * f64::from(k.min(60)), 0.0));
        let point = |k: u32| TrackPoint { time_s: f64::from(k), at: at(k), sigma_m: 2.0 };
        let found = GpsTrack { points: (0..200).map(point).collect() }.distances();
        assert_eq!(found.len(), 4);
        for one in &found {
            assert!(
                (one.metres - 150.0).abs() < 0.01 && (one.sigma_m - 8.0_f64.sqrt()).abs() < 1e-12,
                "{one:?}"
            );
        }
    }

    #[test]
    fn errors_name_the_line() {
        let no_time = GPX.replacen("<time>2024-05-01T10:00:00Z</time>", "", 1);
        for (name, text, said) in [
            ("a.gpx", no_time.as_str(), "a.gpx:3: a point without <time>"),
            ("a.gpx", "<gpx></trk>", "a.gpx:1"),
            ("a.gpx", &GPX.replace("10:00:01.5", "09:00:00"), "a.gpx:4: expected a time after"),
            ("a.gpx", &GPX.replace("49.0001", "490"), "out of range"),
            ("a.nmea", "$GPRMC,1*00\n", "a.nmea:1: checksum"),
            ("a.csv", "time,latitude\n", "a column longitude"),
            ("a.csv", "time,latitude,longitude\n1,2,x\n", "a.csv:2: longitude"),
            ("a.csv", "time,latitude,longitude\n1,2,3\n", "1 points"),
            ("a.txt", "", ".gpx, .nmea or .csv"),
        ] {
            let message = read(name, text).unwrap_err().to_string();
            assert!(message.contains(said), "{message} / {said}");
        }
    }
}
