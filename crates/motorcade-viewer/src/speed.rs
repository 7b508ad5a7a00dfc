//! Speed of the camera and of moving vehicles.

use motorcade::RunResult;

use crate::chart::{Across, Chart, Series};
use crate::hue::hue;
use crate::outline::is_moving;

/// Seconds since the first frame, one a frame.
pub(crate) fn times_s(result: &RunResult) -> Vec<f64> {
    let first = result.frames.first().map_or(0, |f| f.timestamp_ns);
    result.frames.iter().map(|f| (f.timestamp_ns - first) as f64 * 1e-9).collect()
}

/// Speed of the camera at every frame but the first, from its poses \[m/s\].
fn camera(result: &RunResult, times_s: &[f64]) -> Vec<(f64, f64)> {
    let frames = result.ego.frames.windows(2).zip(times_s.windows(2));
    let one = |(f, t): (&[motorcade_odometry::EgoFrame], &[f64])| {
        let step = f[1].world_from_camera.translation() - f[0].world_from_camera.translation();
        let seconds = t[1] - t[0];
        (t[1], if seconds > 0.0 { step.norm() / seconds } else { f64::NAN })
    };
    frames.map(one).collect()
}

/// The chart of speeds.
pub(crate) fn speeds(result: &RunResult) -> String {
    let times = times_s(result);
    let mut series = vec![Series {
        name: "camera".into(),
        class: "camera",
        hue: None,
        vehicle: None,
        values: camera(result, &times),
        sigmas: Vec::new(),
    }];
    for (k, vehicle) in result.vehicles.iter().enumerate().filter(|(_, v)| is_moving(v)) {
        series.push(Series {
            name: format!("{} {}", vehicle.class.name(), vehicle.id),
            class: "vehicle",
            hue: Some(hue(k)),
            vehicle: Some(vehicle.id),
            values: vehicle.states.iter().filter_map(|s| Some((*times.get(s.frame)?, s.speed_mps))).collect(),
            sigmas: Vec::new(),
        });
    }
    let title = "Speed of the camera and of moving vehicles";
    Chart {
        title,
        label: "speed [m/s]",
        unit: "m/s",
        least: 2.0,
        from_zero: true,
        across: Across::Time,
        series,
    }
    .figure()
}
