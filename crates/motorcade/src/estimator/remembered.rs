//! The last scale and road that were measured.

use motorcade_odometry::{EgoFrame, RoadMeasurement, RoadState};
use nalgebra::Matrix3;

/// The last scale and road that were measured, as a measurement.
#[derive(Clone, Copy)]
pub(super) struct Remembered {
    pub(super) segment: usize,
    pub(super) measurement: RoadMeasurement,
}

impl Remembered {
    /// Scale and road of a frame that has them.
    pub(super) fn of(segment: usize, frame: &EgoFrame, height_m: f64) -> Self {
        let up = frame.road_normal;
        let state = RoadState {
            log_inverse_height: (frame.scale / height_m).ln(),
            pitch_rad: (up.z / up.y).atan(),
            roll_rad: (up.x / up.y).atan(),
        };
        // Pitch and roll stand in the upper left there.
        let tilt = frame.road_tilt_covariance;
        let mut covariance = Matrix3::zeros();
        covariance[(0, 0)] = frame.scale_sigma.powi(2);
        covariance.fixed_view_mut::<2, 2>(1, 1).copy_from(&tilt.fixed_view::<2, 2>(0, 0));
        let measurement = RoadMeasurement {
            frame: 0,
            reference: 0,
            state,
            baseline: 1.0,
            covariance,
            curvature: None,
            agreement: 1.0,
            pixels: 0,
        };
        Self { segment, measurement }
    }
}
