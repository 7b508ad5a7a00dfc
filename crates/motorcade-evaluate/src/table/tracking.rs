//! Tables of tracking, of deviations and of P(moving).

use std::fmt::{self, Display};

use crate::moving::MovingReport;
use crate::tracking::{Tracking2dReport, Tracking3dReport};
use crate::vehicle_nees::VehicleConsistency;

impl Display for Tracking3dReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n3D tracking of cars by AB3DMOT's definition [%] ({} labels)", self.labels)?;
        let head = ["sAMOTA", "AMOTA", "AMOTP", "MOTA", "MOTP", "recall", "IDS", "FRAG"];
        let head: String = head.iter().map(|name| format!(" {name:>7}")).collect();
        writeln!(f, "  {:<14}{head}", "")?;
        for (name, m) in [("IoU 0.25", self.iou_25), ("IoU 0.5", self.iou_50)] {
            let shares = [m.samota, m.amota, m.amotp, m.mota, m.motp, m.recall];
            let shares: String = shares.iter().map(|share| format!(" {share:>7.1}")).collect();
            writeln!(f, "  {name:<14}{shares} {:>7} {:>7}", m.id_switches, m.fragmentations)?;
        }
        Ok(())
    }
}

impl Display for Tracking2dReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n2D tracking of cars by TrackEval's definition ({} labels)", self.labels)?;
        writeln!(
            f,
            "  HOTA {:.1} % (DetA {:.1}, AssA {:.1}, LocA {:.1}), MOTA {:.1} %, recall {:.1} %, {} identity switches, {} fragmentations",
            self.hota,
            self.det_a,
            self.ass_a,
            self.loc_a,
            self.mota,
            self.recall,
            self.id_switches,
            self.fragmentations
        )
    }
}

impl Display for VehicleConsistency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\ndeviations of the vehicles ({} frames of vehicles)", self.depth.frames)?;
        let head = ["median NEES", "of", "below 2 σ %", "95 % bound", "band %", "largest σ"];
        let head: String = head.iter().map(|name| format!(" {name:>11}")).collect();
        writeln!(f, "  {:<10}{head}", "")?;
        let percent = |share: f64| format!("{:.1}", 100.0 * share);
        for (name, n) in [("depth", self.depth), ("position", self.position), ("heading", self.heading)] {
            writeln!(
                f,
                "  {name:<10} {:>11.2} {:>11} {:>11} {:>11} {:>11} {:>11.1}",
                n.nees_median,
                n.degrees_of_freedom,
                percent(n.within_two_sigma),
                percent(n.nees_allowed),
                percent(n.nees_in_band),
                n.largest_sigma
            )?;
        }
        Ok(())
    }
}

impl Display for MovingReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nP(moving) of {} vehicles: Brier score {:.3}", self.vehicles, self.brier)?;
        for row in &self.rows {
            let [from, to] = row.range;
            let (said, moves) = (100.0 * row.p_moving, 100.0 * row.moves);
            writeln!(
                f,
                "  {from:.2} to {to:.2}: {:>4} vehicles say {said:>5.1} %, {moves:>5.1} % move",
                row.vehicles
            )?;
        }
        Ok(())
    }
}
