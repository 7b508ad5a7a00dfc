//! Reports as text tables.

mod tracking;

use std::fmt::{self, Display};

use crate::boxes3d::Boxes3dReport;
use crate::ego::EgoReport;
use crate::run::Report;
use crate::vehicles::VehicleReport;

/// A number with a fixed number of digits, or a dash.
fn cell(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

impl Display for EgoReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = |name: &str, value: Option<f64>, digits: usize, unit: &str, note: &str| {
            let text = format!("  {name:<24}{:>10} {unit:<10} {note}", cell(value, digits));
            writeln!(f, "{}", text.trim_end())
        };
        line("ATE, first pose", Some(self.ate_origin_m), 3, "m", "first poses identified")?;
        line("ATE, SE(3)", Some(self.ate_se3_m), 3, "m", "best rotation and translation")?;
        line("ATE, Sim(3)", self.ate_sim3_m, 3, "m", "and best scale")?;
        line("best scale", self.best_scale, 4, "", "true / estimated")?;
        line("scale error", self.scale_error_pct_median, 2, "%", "median over frames")?;
        line("scale error, ±5 frames", self.scale_window_pct_median, 2, "%", "median over windows")?;
        line("  95th percentile", self.scale_window_pct_p95, 2, "%", "")?;
        line("RPE, translation", self.rpe_m, 4, "m", "RMS frame to frame")?;
        line("RPE, rotation", self.rpe_deg, 4, "deg", "RMS frame to frame")?;
        line("rotation at the end", Some(self.rotation_end_deg), 3, "deg", "")?;
        line("rotation drift", self.rotation_deg_per_100m, 3, "deg/100 m", "")
    }
}

impl Display for VehicleReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let depth = self.depth_m.map_or_else(|| "-".to_owned(), |[near, far]| format!("{near:.1}-{far:.1}"));
        write!(
            f,
            "  {:>5} {:>7} {:>9.1} {:>9} {:>11} {:>10} {:>10} {:>10} {:>10}",
            self.label,
            self.frames,
            100.0 * self.coverage,
            self.id_switches,
            depth,
            cell(self.ate_origin_m, 2),
            cell(self.ate_ego_se3_m, 2),
            cell(self.error_in_camera_m, 2),
            cell(self.heading_error_deg, 1)
        )
    }
}

impl Display for Boxes3dReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [easy, moderate, hard] = self.labels;
        writeln!(f, "\n3D boxes of cars, AP|R40 by KITTI's rules [%] ({easy}, {moderate}, {hard} labels)")?;
        writeln!(f, "  {:<24}{:>10} {:>10} {:>10}", "", "easy", "moderate", "hard")?;
        let rows = [
            ("3D, IoU 0.5", self.ap3d_50),
            ("3D, IoU 0.7", self.ap3d_70),
            ("from above, IoU 0.5", self.bev_50),
            ("from above, IoU 0.7", self.bev_70),
        ];
        for (name, ap) in rows {
            writeln!(f, "  {name:<24}{:>10.1} {:>10.1} {:>10.1}", ap.easy, ap.moderate, ap.hard)?;
        }
        Ok(())
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ego = &self.ego;
        writeln!(
            f,
            "KITTI tracking {} camera {}: {} frames from {}, {:.1} m\n\ncamera",
            self.sequence, self.camera, ego.frames, self.first, ego.length_m
        )?;
        write!(f, "{ego}")?;
        if let Some(c) = &self.consistency {
            let (allowed, band) = (100.0 * c.nees_allowed, 100.0 * c.nees_in_band);
            let text = format!(
                "median {:.1} of 6, {allowed:.0} % within the 95 % bound, {band:.0} % in the band",
                c.nees_median
            );
            writeln!(f, "  {:<24}{text}", "NEES of the poses")?;
        }
        self.write_vehicles(f)?;
        let parts: [Option<&dyn Display>; 5] = [
            self.vehicles_consistency.as_ref().map(|part| part as &dyn Display),
            self.moving.as_ref().map(|part| part as &dyn Display),
            self.boxes3d.as_ref().map(|part| part as &dyn Display),
            self.tracking3d.as_ref().map(|part| part as &dyn Display),
            self.tracking2d.as_ref().map(|part| part as &dyn Display),
        ];
        parts.into_iter().flatten().try_for_each(|part| write!(f, "{part}"))
    }
}

impl Report {
    /// The table of the labelled vehicles.
    fn write_vehicles(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(vehicles) = &self.vehicles else {
            return writeln!(f, "\nvehicles: the run gives no tracks");
        };
        writeln!(f, "\nvehicles (labels unoccluded, untruncated, 40 px high, within 50 m; IoU 0.5)")?;
        writeln!(
            f,
            "  {:>5} {:>7} {:>9} {:>9} {:>11} {:>10} {:>10} {:>10} {:>10}",
            "label",
            "frames",
            "covered %",
            "switches",
            "depth m",
            "ATE 1st m",
            "ATE SE3 m",
            "in cam m",
            "head. deg"
        )?;
        for vehicle in vehicles {
            writeln!(f, "{vehicle}")?;
        }
        let Some(mean) = &self.vehicles_mean else {
            return writeln!(f, "  no labelled vehicle has an estimate");
        };
        writeln!(
            f,
            "  {:>5} {:>7} {:>9.1} {:>9} {:>11} {:>10.2} {:>10.2} {:>10.2} {:>10.1}",
            "mean",
            mean.vehicles,
            100.0 * mean.coverage,
            mean.id_switches,
            "",
            mean.ate_origin_m,
            mean.ate_ego_se3_m,
            mean.error_in_camera_m,
            mean.heading_error_deg
        )?;
        writeln!(
            f,
            "  error of depth within 40 m: median {} %, 90th percentile {} %",
            cell(mean.depth_error_pct_median, 1),
            cell(mean.depth_error_pct_p90, 1)
        )?;
        writeln!(
            f,
            "  error of motion from frame to frame: {} m, {} deg; of those that move, over a metre: {} m, {} deg",
            cell(mean.motion_error_m, 3),
            cell(mean.motion_error_deg, 2),
            cell(mean.rpe_m_per_m, 3),
            cell(mean.rpe_deg_per_m, 2)
        )
    }
}
