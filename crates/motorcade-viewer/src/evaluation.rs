//! Errors against ground truth, as tables.

use motorcade_evaluate::{Report, VehicleReport};

use crate::text::{escape, maybe, number};

/// Tables of errors.
pub(crate) fn evaluation(report: &Report) -> String {
    let ego = &report.ego;
    let rows = [
        ("ATE, first poses identified [m]", number(ego.ate_origin_m, 3)),
        ("ATE after SE(3) alignment [m]", number(ego.ate_se3_m, 3)),
        ("ATE after Sim(3) alignment [m]", maybe(ego.ate_sim3_m, 3)),
        ("best scale, true / estimated", maybe(ego.best_scale, 4)),
        ("scale error, median over frames [%]", maybe(ego.scale_error_pct_median, 2)),
        ("RPE of translation, frame to frame [m]", maybe(ego.rpe_m, 4)),
        ("RPE of rotation, frame to frame [°]", maybe(ego.rpe_deg, 4)),
        ("rotation error of the last frame [°]", number(ego.rotation_end_deg, 3)),
        ("rotation drift [°/100 m]", maybe(ego.rotation_deg_per_100m, 3)),
    ];
    let mut out = format!(
        "<section><h2>Against ground truth</h2><p>KITTI tracking {}, camera {}: {} frames from {}, {} m.</p>\n<table><tbody>\n",
        escape(&report.sequence),
        report.camera,
        ego.frames,
        report.first,
        number(ego.length_m, 1)
    );
    for (name, value) in rows {
        out += &format!("<tr><td>{name}</td><td>{value}</td></tr>\n");
    }
    out += "</tbody></table>\n";
    if let Some(vehicles) = report.vehicles.as_deref().filter(|v| !v.is_empty()) {
        out += "<div class=\"wide\"><table><thead><tr><th>label</th><th>frames</th><th>covered [%]</th><th>switches</th>\
                <th>ATE, first poses [m]</th><th>ATE, camera's SE(3) [m]</th><th>in camera [m]</th><th>heading [°]</th></tr>\
                </thead><tbody>\n";
        out += &vehicles.iter().map(row).collect::<String>();
        out += "</tbody>";
        if let Some(mean) = &report.vehicles_mean {
            out += &cells(&[
                "mean".to_owned(),
                mean.vehicles.to_string(),
                number(100.0 * mean.coverage, 1),
                mean.id_switches.to_string(),
                number(mean.ate_origin_m, 2),
                number(mean.ate_ego_se3_m, 2),
                number(mean.error_in_camera_m, 2),
                number(mean.heading_error_deg, 1),
            ])
            .replace("<tr>", "<tfoot><tr>");
            out += "</tfoot>";
        }
        out += "</table></div>\n";
    }
    out + &tracking(report) + "</section>\n"
}

/// Table of how well the vehicles were told apart, placed and known; nothing without tracks.
fn tracking(report: &Report) -> String {
    let mut rows: Vec<(String, String)> = Vec::new();
    if let Some(boxes) = &report.boxes3d {
        rows.push((
            "3D average precision of cars, moderate, IoU 0.5 and 0.7 [%]".into(),
            format!("{:.1}, {:.1}", boxes.ap3d_50.moderate, boxes.ap3d_70.moderate),
        ));
    }
    if let Some(of) = report.tracking3d.map(|t| t.iou_25) {
        rows.push((
            "3D tracking of cars, IoU 0.25: sAMOTA, AMOTA [%]".into(),
            format!("{:.1}, {:.1}", of.samota, of.amota),
        ));
    }
    if let Some(of) = &report.tracking2d {
        rows.push(("2D tracking of cars: HOTA [%]".into(), number(of.hota, 1)));
        rows.push(("identity switches (TrackEval)".into(), of.id_switches.to_string()));
    }
    if let Some(of) = &report.vehicles_consistency {
        for (name, nees) in [("depth", of.depth), ("heading", of.heading)] {
            let value = format!("{:.0} %, {:.1} σ", 100.0 * nees.within_two_sigma, nees.largest_sigma);
            rows.push((format!("errors of {name} below twice their deviation; the largest"), value));
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    let rows: String =
        rows.iter().map(|(name, value)| format!("<tr><td>{name}</td><td>{value}</td></tr>\n")).collect();
    format!("<table><tbody>\n{rows}</tbody></table>\n")
}

fn row(vehicle: &VehicleReport) -> String {
    cells(&[
        vehicle.label.to_string(),
        vehicle.frames.to_string(),
        number(100.0 * vehicle.coverage, 1),
        vehicle.id_switches.to_string(),
        maybe(vehicle.ate_origin_m, 2),
        maybe(vehicle.ate_ego_se3_m, 2),
        maybe(vehicle.error_in_camera_m, 2),
        maybe(vehicle.heading_error_deg, 1),
    ])
}

fn cells(values: &[String]) -> String {
    let cells: String = values.iter().map(|v| format!("<td>{v}</td>")).collect();
    format!("<tr>{cells}</tr>\n")
}
