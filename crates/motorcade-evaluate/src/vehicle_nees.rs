//! Consistency of the vehicles' places and headings with their standard deviations.

use motorcade_dataset::Label;
use motorcade_geometry::robust::median_midpoint;
use nalgebra::Vector3;

use crate::deviations::VehicleDeviations;

/// Degrees of freedom, 95 % quantile, and 2.5 % and 97.5 % quantiles of χ².
const CHI2_1: (usize, f64, [f64; 2]) = (1, 3.841, [0.000_982, 5.024]);
const CHI2_3: (usize, f64, [f64; 2]) = (3, 7.815, [0.215_8, 9.348]);

/// NEES of the vehicles over their evaluated frames. Errors of the labels (some 0.1 m) count as errors of the run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct VehicleConsistency {
    /// Depth: distance along the optical axis.
    pub depth: NeesReport,
    /// Position relative to the camera, by the deviations along the vehicle's axes.
    pub position: NeesReport,
    /// Heading.
    pub heading: NeesReport,
}

/// Normalised estimation errors squared, eᵀ Σ⁻¹ e (Bar-Shalom et al. 2001, section 5.4).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct NeesReport {
    /// Numbers in e.
    pub degrees_of_freedom: usize,
    /// Values: frames of vehicles.
    pub frames: usize,
    /// Median; 0.455 of one degree of freedom and 2.366 of three for consistent deviations, less when they are too large.
    pub nees_median: f64,
    /// Share below the 95 % quantile.
    pub nees_allowed: f64,
    /// Share within the two-sided 95 % band.
    pub nees_in_band: f64,
    /// Share of errors below twice their deviation: 0.954 of one degree of freedom, 0.739 of three.
    pub within_two_sigma: f64,
    /// Largest error in deviations.
    pub largest_sigma: f64,
}

/// NEES of one vehicle in one frame: depth, position, heading.
#[derive(Clone, Copy)]
pub(crate) struct VehicleNees {
    depth: f64,
    position: f64,
    heading: f64,
}

impl VehicleNees {
    /// `error_m` is estimated less labelled position in camera coordinates, `turn_rad` the error of the heading; `None` where a deviation is zero.
    pub(crate) fn new(
        estimate: &Label,
        error_m: &Vector3<f64>,
        turn_rad: f64,
        deviations: &VehicleDeviations,
    ) -> Option<Self> {
        let (sin, cos) = estimate.ry_rad.sin_cos();
        // Forward, left and up of a vehicle whose rotation about y (down) is zero when it heads to the right.
        let axes = [Vector3::new(cos, 0.0, -sin), Vector3::new(sin, 0.0, cos), Vector3::new(0.0, -1.0, 0.0)];
        let sigmas = [deviations.forward_m, deviations.left_m, deviations.up_m];
        let ratio = |k: usize| error_m.dot(&axes[k]) / sigmas[k];
        let depth_variance: f64 = (0..3).map(|k| (axes[k].z * sigmas[k]).powi(2)).sum();
        let nees = Self {
            depth: error_m.z * error_m.z / depth_variance,
            position: (0..3).map(|k| ratio(k).powi(2)).sum(),
            heading: (turn_rad / deviations.heading_rad).powi(2),
        };
        [nees.depth, nees.position, nees.heading].iter().all(|v| v.is_finite()).then_some(nees)
    }
}

impl VehicleConsistency {
    /// `None` without values.
    pub(crate) fn of(all: &[VehicleNees]) -> Option<Self> {
        let report = |of: fn(&VehicleNees) -> f64, chi2| NeesReport::new(all.iter().map(of).collect(), chi2);
        Some(Self {
            depth: report(|v| v.depth, CHI2_1)?,
            position: report(|v| v.position, CHI2_3)?,
            heading: report(|v| v.heading, CHI2_1)?,
        })
    }
}

impl NeesReport {
    fn new(mut values: Vec<f64>, (degrees_of_freedom, bound, band): (usize, f64, [f64; 2])) -> Option<Self> {
        let share = |within: &dyn Fn(f64) -> bool| {
            values.iter().filter(|v| within(**v)).count() as f64 / values.len().max(1) as f64
        };
        Some(Self {
            degrees_of_freedom,
            frames: values.len(),
            nees_allowed: share(&|v| v <= bound),
            nees_in_band: share(&|v| (band[0]..=band[1]).contains(&v)),
            within_two_sigma: share(&|v| v <= 4.0),
            largest_sigma: values.iter().copied().fold(0.0, f64::max).sqrt(),
            nees_median: median_midpoint(&mut values)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::BoundingBox;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn errors_are_divided_by_the_deviations_along_the_axes_of_the_vehicle() {
        let estimate = |ry_rad| Label {
            frame: 0,
            track: 1,
            class: "Car".into(),
            truncated: 0.0,
            occluded: 0.0,
            alpha_rad: 0.0,
            bbox: BoundingBox::new([0.0; 4]),
            size_hwl_m: [1.5, 1.6, 4.0],
            location_m: [0.0, 1.6, 20.0],
            ry_rad,
            score: None,
        };
        let deviations = VehicleDeviations {
            frame: 0,
            id: 1,
            forward_m: 2.0,
            left_m: 0.5,
            up_m: 0.1,
            heading_rad: 0.1,
            p_moving: 0.5,
        };
        let error = Vector3::new(0.5, 0.1, 2.0);
        let of = |ry| VehicleNees::new(&estimate(ry), &error, 0.2, &deviations).unwrap();
        // Ahead: its length lies along the depth.
        let ahead = of(-FRAC_PI_2);
        assert!(
            (ahead.depth - 1.0).abs() < 1e-12 && (ahead.position - 3.0).abs() < 1e-12,
            "{}",
            ahead.position
        );
        assert!((ahead.heading - 4.0).abs() < 1e-12);
        // Across: its width does.
        let across = of(0.0);
        assert!(
            (across.depth - 16.0).abs() < 1e-12 && (across.position - (16.0 + 1.0 + 0.0625)).abs() < 1e-12
        );
        let none = VehicleDeviations { heading_rad: 0.0, ..deviations };
        assert!(VehicleNees::new(&estimate(0.0), &error, 0.2, &none).is_none());

        let report = VehicleConsistency::of(&[ahead, across, ahead]).unwrap().depth;
        assert_eq!((report.frames, report.nees_median, report.largest_sigma), (3, 1.0, 4.0));
        assert!((report.within_two_sigma - 2.0 / 3.0).abs() < 1e-12);
        assert!(VehicleConsistency::of(&[]).is_none());
    }
}
