//! The table of vehicles.

use motorcade::RunResult;
use motorcade_geometry::robust::median_midpoint;
use motorcade_vehicles::{Source, VehicleTrajectory};

use crate::hue::hue;
use crate::outline::{position, sigma_m};
use crate::speed::KMH;
use crate::text::{escape, maybe, number};

/// One row per vehicle.
pub(crate) fn table(result: &RunResult) -> String {
    if !result.detects_vehicles {
        return "<p>No vehicles were looked for: the run had neither networks nor detections.</p>\n"
            .to_owned();
    }
    if result.vehicles.is_empty() {
        return "<p>No vehicles were found.</p>\n".to_owned();
    }
    let mut out = "<div class=\"wide\"><table><thead><tr><th>id</th><th>class</th><th>frames</th><th>observed in</th>\
                   <th>P(moving)</th><th>length × width × height [m]</th><th>mean speed [km/h]</th><th>max speed [km/h]</th>\
                   <th>nearest [m]</th><th>position σ [m]</th></tr></thead><tbody>\n"
        .to_owned();
    for (k, vehicle) in result.vehicles.iter().enumerate() {
        out += &row(result, vehicle, k);
    }
    out + "</tbody></table></div>\n<p class=\"note\">Nearest: distance between camera and vehicle centre, along the road. \
           Position σ: median over frames, on the road.</p>\n"
}

fn row(result: &RunResult, vehicle: &VehicleTrajectory, index: usize) -> String {
    let states = &vehicle.states;
    let frame = |k: usize| result.frames.get(k).map_or(0, |f| f.number);
    let ends = states.first().zip(states.last());
    let frames = ends.map_or_else(String::new, |(a, b)| format!("{}–{}", frame(a.frame), frame(b.frame)));
    let observed = states.iter().filter(|s| s.source != Source::Predicted).count();
    let speeds = states.iter().map(|s| KMH * s.speed_mps.abs());
    let mean = (!states.is_empty()).then(|| speeds.clone().sum::<f64>() / states.len() as f64);
    let distance = |s: &motorcade_vehicles::VehicleState| {
        let ego = result.ego.frames.get(s.frame)?;
        Some((position(s) - ego.world_from_camera.translation().xz()).norm())
    };
    let mut sigmas: Vec<f64> = states.iter().map(sigma_m).collect();
    let size = vehicle.size;
    let cells = [
        escape(vehicle.class.name()),
        frames,
        format!("{observed} of {}", states.len()),
        number(vehicle.p_moving, 2),
        format!("{} × {} × {}", number(size.length_m, 2), number(size.width_m, 2), number(size.height_m, 2)),
        maybe(mean, 1),
        maybe(speeds.max_by(f64::total_cmp), 1),
        maybe(states.iter().filter_map(distance).min_by(f64::total_cmp), 1),
        maybe(median_midpoint(&mut sigmas), 2),
    ];
    let chip = format!("<span class=\"chip\" style=\"--h:{}\"></span>", hue(index));
    let id = vehicle.id;
    let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
    // A click on it is one on its row; it can be reached by the keyboard.
    let follow = format!(
        "<button type=\"button\" class=\"id\" aria-pressed=\"false\" aria-label=\"Follow vehicle {id}\">{id}</button>"
    );
    format!("<tr data-vehicle=\"{id}\"><td>{chip}{follow}</td>{cells}</tr>\n")
}
