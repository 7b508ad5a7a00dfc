//! Metric scale and the road over time, each with a band of one standard deviation.

use motorcade::RunResult;
use motorcade_odometry::{EgoFrame, road_tilt};

use crate::chart::{Across, Chart, Series};
use crate::speed::times_s;

/// The charts of scale and road.
pub(crate) fn road(result: &RunResult) -> String {
    let times = times_s(result);
    let line = |name: &str, class, value: fn(&EgoFrame) -> f64, sigma: fn(&EgoFrame) -> f64| Series {
        name: name.to_owned(),
        class,
        hue: None,
        vehicle: None,
        values: times.iter().copied().zip(result.ego.frames.iter().map(value)).collect(),
        sigmas: result.ego.frames.iter().take(times.len()).map(sigma).collect(),
    };
    let scale = Chart {
        title: "Metric scale",
        label: "m per odometry unit",
        unit: "m",
        least: 0.05,
        from_zero: false,
        across: Across::Time,
        series: vec![line(
            "scale ± σ",
            "camera",
            |f| f.scale,
            |f| f.scale * f.scale_sigma.hypot(f.scale_bias_sigma),
        )],
    };
    let road = Chart {
        title: "Road seen from the camera",
        label: "angle [°]",
        unit: "°",
        least: 0.5,
        from_zero: true,
        across: Across::Time,
        series: vec![
            line("pitch ± σ (positive: the camera looks down)", "camera", pitch_deg, |f| tilt_deg(f, 0)),
            line("roll ± σ", "second", roll_deg, |f| tilt_deg(f, 1)),
        ],
    };
    scale.figure() + &road.figure()
}

fn pitch_deg(frame: &EgoFrame) -> f64 {
    road_tilt(&frame.road_normal).0.to_degrees()
}

fn roll_deg(frame: &EgoFrame) -> f64 {
    road_tilt(&frame.road_normal).1.to_degrees()
}

fn tilt_deg(frame: &EgoFrame, k: usize) -> f64 {
    frame.road_tilt_covariance[(k, k)].max(0.0).sqrt().to_degrees()
}
