//! The last scale and road measured, which stand in where a window holds no measurement: after minutes at a light, on a road that
//! nothing shows.

use motorcade_odometry::{EgoFrame, RoadMeasurement, RoadState, road_tilt};
use nalgebra::Matrix3;

/// A measurement of earlier, and the way since.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Remembered {
    /// Segment of the odometry whose unit it measured.
    pub segment: usize,
    measurement: RoadMeasurement,
    /// Drift of log scale per √(camera height travelled).
    drift: f64,
    /// Way since \[camera heights\].
    travelled: f64,
}

impl Remembered {
    /// The scale and the road of a frame of this segment under a camera `height_m` high, whose unit drifts by `drift`.
    pub fn new(segment: usize, frame: &EgoFrame, height_m: f64, drift: f64) -> Self {
        let (pitch_rad, roll_rad) = road_tilt(&frame.road_normal);
        let state = RoadState { log_inverse_height: (frame.scale / height_m).ln(), pitch_rad, roll_rad };
        let tilt = frame.road_tilt_covariance;
        // Pitch and roll stand in the upper left there.
        let covariance = Matrix3::new(
            frame.scale_sigma.powi(2),
            0.0,
            0.0,
            0.0,
            tilt[(0, 0)],
            tilt[(0, 1)],
            0.0,
            tilt[(1, 0)],
            tilt[(1, 1)],
        );
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
        Self { segment, measurement, drift, travelled: 0.0 }
    }

    /// The camera drove on by this many camera heights.
    pub fn travel(&mut self, heights: f64) {
        self.travelled += heights;
    }

    /// The measurement as it counts now: the unit has drifted since by a random walk over the way.
    pub fn measurement(&self) -> RoadMeasurement {
        let mut out = self.measurement;
        out.covariance[(0, 0)] += self.drift * self.drift * self.travelled;
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use motorcade_odometry::FrameStatus;
    use nalgebra::{Matrix6, Vector3};

    #[test]
    fn a_scale_that_is_not_measured_grows_uncertain_with_the_way_and_not_with_the_time() {
        let frame = EgoFrame {
            world_from_camera: Pose::identity(),
            status: FrameStatus::Tracked,
            step_measured: true,
            step_covariance: Matrix6::zeros(),
            covariance: Matrix6::zeros(),
            scale: 0.8,
            scale_sigma: 0.01,
            scale_sigma_alone: 0.01,
            scale_correlation: 0.0,
            scale_bias_sigma: 0.0,
            scale_measured: true,
            road_normal: -Vector3::y(),
            road_tilt_covariance: Matrix3::identity() * 1e-6,
            inliers: 100,
        };
        let mut remembered = Remembered::new(0, &frame, 1.6, 0.004);
        let sigma = |r: &Remembered| r.measurement().covariance[(0, 0)].sqrt();
        assert!((sigma(&remembered) - 0.01).abs() < 1e-12);
        // A kilometre in steps of a camera height.
        (0..625).for_each(|_| remembered.travel(1.0));
        assert!((sigma(&remembered) - 0.1_f64.hypot(0.01)).abs() < 1e-9);
        assert!((remembered.measurement().state.log_inverse_height - 0.5_f64.ln()).abs() < 1e-12);
    }
}
