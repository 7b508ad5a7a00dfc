//! The vehicle ahead of the camera: its distance over time, and what of it is quoted.

use motorcade::{Estimated, FrameSpeeds, RunResult};
use motorcade_vehicles::Source;

use crate::chart::{Across, Chart, Series};
use crate::hue::hue;
use crate::speed::times_s;
use crate::text::{escape, estimate, quantity};

/// The chart of distances; nothing where no vehicle was ever ahead.
pub(crate) fn distances(result: &RunResult, speeds: &[FrameSpeeds]) -> String {
    let times = times_s(result);
    let mut series: Vec<Series> = Vec::new();
    for (k, vehicle) in result.vehicles.iter().enumerate() {
        let rows = times.iter().zip(speeds).map(|(time, row)| {
            let distance = row.ahead.as_ref().filter(|a| a.id == vehicle.id).map(|a| a.distance_m);
            (*time, distance.unwrap_or(Estimated { value: f64::NAN, sigma: 0.0 }))
        });
        let (values, sigmas): (Vec<_>, Vec<_>) = rows.map(|(time, d)| ((time, d.value), d.sigma)).unzip();
        if values.iter().any(|(_, value)| value.is_finite()) {
            series.push(Series {
                name: format!("{} {}", vehicle.class.name(), vehicle.id),
                class: "vehicle",
                hue: Some(hue(k)),
                vehicle: Some(vehicle.id),
                values,
                sigmas,
            });
        }
    }
    let title = "Distance to the vehicle ahead, with its standard deviation";
    Chart {
        title,
        label: "distance [m]",
        unit: "m",
        least: 5.0,
        from_zero: true,
        across: Across::Time,
        series,
    }
    .figure()
}

/// True when the vehicle was measured in a frame, not predicted.
fn is_seen(result: &RunResult, id: usize, frame: usize) -> bool {
    let vehicle = result.vehicles.iter().find(|v| v.id == id);
    let state = vehicle.and_then(|v| v.states.iter().find(|s| s.frame == frame));
    state.is_some_and(|s| s.source != Source::Predicted)
}

/// Table of the numbers of a drive that are quoted: speeds, and the extremes of the vehicle ahead. Extremes are those of frames whose pose was measured,
/// and of vehicles that were seen there: what is filled in or predicted is no observation of the drive.
pub(crate) fn quoted(result: &RunResult, speeds: &[FrameSpeeds]) -> String {
    let times = times_s(result);
    let duration_s = times.last().copied().unwrap_or(0.0);
    let mut rows: Vec<(&str, String, String)> = Vec::new();
    if duration_s > 0.0 {
        let mean = result.ego.length_m() / duration_s;
        rows.push(("mean speed", quantity(3.6 * mean, 1, "km/h"), String::new()));
    }
    let measured = |frame: usize| result.ego.frames.get(frame).is_some_and(|f| f.step_measured);
    let rows_in_time = || speeds.iter().zip(&times).enumerate().filter(|(frame, _)| measured(*frame));
    let fastest = rows_in_time().map(|(_, row)| row).filter(|(row, _)| row.speed_mps.sigma.is_finite());
    if let Some((row, time)) = fastest.max_by(|a, b| a.0.speed_mps.value.total_cmp(&b.0.speed_mps.value)) {
        let value = estimate(3.6 * row.speed_mps.value, 3.6 * row.speed_mps.sigma, 1, "km/h");
        rows.push(("highest speed", value, at(*time)));
    }
    let with_ahead = speeds.iter().filter(|row| row.ahead.is_some()).count();
    let share = with_ahead as f64 / speeds.len().max(1) as f64;
    rows.push(("frames with a vehicle ahead", quantity(100.0 * share, 0, "%"), String::new()));
    let ahead = || {
        let ahead =
            rows_in_time().filter_map(|(frame, (row, time))| Some((frame, row.ahead.as_ref()?, *time)));
        ahead.filter(|(frame, a, _)| is_seen(result, a.id, *frame)).map(|(_, a, time)| (a, time))
    };
    let least = |values: Vec<(Estimated, usize, f64)>| {
        values.into_iter().min_by(|a, b| a.0.value.total_cmp(&b.0.value))
    };
    for (name, unit, found) in [
        ("shortest distance ahead", "m", least(ahead().map(|(a, t)| (a.distance_m, a.id, t)).collect())),
        (
            "shortest time gap",
            "s",
            least(ahead().filter_map(|(a, t)| Some((a.time_gap_s?, a.id, t))).collect()),
        ),
        (
            "shortest time to collision",
            "s",
            least(ahead().filter_map(|(a, t)| Some((a.time_to_collision_s?, a.id, t))).collect()),
        ),
    ] {
        if let Some((e, id, time)) = found {
            let value = estimate(e.value, e.sigma, 2, unit);
            rows.push((name, value, format!("vehicle {id}, {}", at(time))));
        }
    }
    rows.push(focal_length(result));
    let row = |(name, value, note): &(&str, String, String)| {
        format!(
            "<tr><th>{}</th><td class=\"estimate\">{}</td><td>{}</td></tr>",
            escape(name),
            escape(value),
            escape(note)
        )
    };
    let body: String = rows.iter().map(row).collect();
    format!("<section><h2>In short</h2><table>{body}</table></section>\n")
}

/// The focal length that the turns of the drive say, beside the stated one.
fn focal_length(result: &RunResult) -> (&'static str, String, String) {
    match &result.focal_by_turns {
        Some(found) => {
            let stated = format!(
                "{} stated; an error below {} is not noticed",
                quantity(found.stated_px, 0, "px"),
                quantity(100.0 * found.least_error_told, 0, "%")
            );
            ("focal length by the turns", estimate(found.px, found.sigma_px, 0, "px"), stated)
        }
        None => (
            "focal length by the turns",
            "not determined".to_owned(),
            "it turns too little, or was calibrated by the drive".to_owned(),
        ),
    }
}

fn at(time_s: f64) -> String {
    format!("at {}", quantity(time_s, 1, "s"))
}
