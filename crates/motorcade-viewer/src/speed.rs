//! Speed of the camera and of moving vehicles.

use motorcade::{FrameSpeeds, RunResult};

use crate::chart::{Across, Chart, Series};
use crate::hue::hue;
use crate::outline::is_moving;

/// Kilometres an hour in a metre a second.
pub(crate) const KMH: f64 = 3.6;

/// Seconds since the first frame, one a frame.
pub(crate) fn times_s(result: &RunResult) -> Vec<f64> {
    let first = result.frames.first().map_or(0, |f| f.timestamp_ns);
    result.frames.iter().map(|f| (f.timestamp_ns - first) as f64 * 1e-9).collect()
}

/// The chart of speeds. That of the camera is the one of `speeds.csv`: steps between frames jump where a recorder lost one.
pub(crate) fn speeds(result: &RunResult, of_frames: &[FrameSpeeds]) -> String {
    let times = times_s(result);
    let camera = times
        .iter()
        .zip(of_frames)
        .map(|(time, row)| ((*time, KMH * row.speed_mps.value), KMH * row.speed_mps.sigma));
    let (values, sigmas) = camera.unzip();
    let mut series =
        vec![Series { name: "camera".into(), class: "camera", hue: None, vehicle: None, values, sigmas }];
    for (k, vehicle) in result.vehicles.iter().enumerate().filter(|(_, v)| is_moving(v)) {
        series.push(Series {
            name: format!("{} {}", vehicle.class.name(), vehicle.id),
            class: "vehicle",
            hue: Some(hue(k)),
            vehicle: Some(vehicle.id),
            values: vehicle
                .states
                .iter()
                .filter_map(|s| Some((*times.get(s.frame)?, KMH * s.speed_mps)))
                .collect(),
            sigmas: Vec::new(),
        });
    }
    let title = "Speed of the camera and of moving vehicles";
    Chart {
        title,
        label: "speed [km/h]",
        unit: "km/h",
        least: 7.0,
        from_zero: true,
        across: Across::Time,
        series,
    }
    .figure()
}
