//! The tables: Markdown for people, CSV for programs.

use std::fmt::Write;

use motorcade_evaluate::VehicleReport;

use super::Row;

/// A number, or a dash.
pub fn cell(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"))
}

/// Camera only.
pub fn odometry(rows: &[Row]) -> String {
    let mut out = String::from(
        "| variant | ATE first pose m | ATE SE(3) m | ATE Sim(3) m | best scale | scale error ±5 frames: median % | 95 % | rotation °/100 m |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let e = &row.ego;
        let _ = writeln!(
            out,
            "| {} | {:.2} | {:.2} | {} | {} | {} | {} | {} |",
            row.name,
            e.ate_origin_m,
            e.ate_se3_m,
            cell(e.ate_sim3_m, 2),
            cell(e.best_scale, 4),
            cell(e.scale_window_pct_median, 2),
            cell(e.scale_window_pct_p95, 2),
            cell(e.rotation_deg_per_100m, 2)
        );
    }
    out
}

/// Camera and every labelled vehicle; in brackets the error in percent of the distance driven, as in the paper's tables.
pub fn graph(rows: &[Row]) -> String {
    let mut labels: Vec<i64> = rows.iter().flat_map(|r| r.vehicles.iter().map(|v| v.label)).collect();
    labels.sort_unstable();
    labels.dedup();
    let mut out =
        String::from("| variant | ego ATE SE(3) m | ego ATE first pose m (%) | mean of vehicles m |");
    for label in &labels {
        let _ = write!(out, " vehicle {label} m (%) |");
    }
    out.push_str("\n|---|---|---|---|");
    out.push_str(&"---|".repeat(labels.len()));
    out.push('\n');
    for row in rows {
        let e = &row.ego;
        let mean = mean_of_vehicles(&row.vehicles);
        let _ = write!(
            out,
            "| {} | {:.2} | {:.2} ({:.1}) | {} |",
            row.name,
            e.ate_se3_m,
            e.ate_origin_m,
            100.0 * e.ate_origin_m / e.length_m.max(1e-9),
            mean
        );
        for label in &labels {
            let vehicle = row.vehicles.iter().find(|v| v.label == *label);
            let _ = write!(out, " {} |", vehicle.map_or_else(|| "–".to_owned(), with_percent));
        }
        out.push('\n');
    }
    out
}

/// Mean over the vehicles with an estimate, and their number where some have none.
fn mean_of_vehicles(vehicles: &[VehicleReport]) -> String {
    let ates: Vec<f64> = vehicles.iter().filter_map(|v| v.ate_origin_m).collect();
    let mean = (!ates.is_empty()).then(|| ates.iter().sum::<f64>() / ates.len() as f64);
    let mean = cell(mean, 2);
    if ates.len() == vehicles.len() { mean } else { format!("{mean} ({} of {})", ates.len(), vehicles.len()) }
}

/// A standing vehicle has no way to take a share of.
fn with_percent(vehicle: &VehicleReport) -> String {
    const STANDING_M: f64 = 10.0;
    let metres = cell(vehicle.ate_origin_m, 2);
    match vehicle.ate_origin_m {
        Some(ate) if vehicle.driven_m > STANDING_M => {
            format!("{metres} ({:.1})", 100.0 * ate / vehicle.driven_m)
        }
        _ => metres,
    }
}

/// Columns of `ablation.csv`.
const COLUMNS: &str = "variant,vehicle,ate_first_pose_m,ate_se3_m,ate_sim3_m,best_scale,coverage,error_in_camera_m,heading_error_deg\n";

/// Everything, a row a variant and vehicle; the camera's row has no vehicle.
pub fn csv(rows: &[Row]) -> String {
    format!("{COLUMNS}{}", csv_rows("", rows))
}

/// The same of several tables, with their names in the first column.
pub fn csv_of_tables(tables: &[(&str, &[Row])]) -> String {
    let rows = tables.iter().map(|(name, rows)| csv_rows(&format!("{name},"), rows));
    format!("table,{COLUMNS}{}", rows.collect::<String>())
}

fn csv_rows(prefix: &str, rows: &[Row]) -> String {
    let mut out = String::new();
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.6}"));
    for row in rows {
        let name = format!("{prefix}{}", row.name.replace(',', ";"));
        let e = &row.ego;
        let (sim3, scale) = (number(e.ate_sim3_m), number(e.best_scale));
        let _ = writeln!(out, "{name},,{:.6},{:.6},{sim3},{scale},,,", e.ate_origin_m, e.ate_se3_m);
        for v in &row.vehicles {
            let (origin, se3) = (number(v.ate_origin_m), number(v.ate_ego_se3_m));
            let (in_camera, heading) = (number(v.error_in_camera_m), number(v.heading_error_deg));
            let _ =
                writeln!(out, "{name},{},{origin},{se3},,,{:.4},{in_camera},{heading}", v.label, v.coverage);
        }
    }
    out
}
