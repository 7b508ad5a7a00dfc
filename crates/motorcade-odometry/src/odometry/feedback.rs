//! Feedback of the road into the bundle adjustment, and of the road into the classification of vehicles.

use motorcade_geometry::BoundingBox;
use nalgebra::Vector3;

use super::Odometry;
use crate::road::{RoadMeasurement, road_normal};
use crate::time::nanoseconds;

/// The road of the last processed frame, and its vehicles.
#[derive(Clone, Copy, Debug, Default)]
pub struct RoadFeedback<'a> {
    /// Measurement made in this frame.
    pub measurement: Option<&'a RoadMeasurement>,
    /// Road plane in the camera frame (m with `mᵀX = 1`, in the odometry's unit).
    pub plane: Option<Vector3<f64>>,
    /// Detections of vehicles that may be classified as static.
    pub vehicles: &'a [BoundingBox],
}

impl Odometry {
    /// Applies what the road says of the last processed frame: scale and plane constrain the next adjustments, and landmarks
    /// on static vehicles are used from now on.
    pub fn apply_road(&mut self, feedback: &RoadFeedback<'_>) {
        if let Some(measurement) = feedback.measurement {
            self.constrain_scale(measurement);
        }
        if let Some(plane) = &feedback.plane {
            self.classify_static_vehicles(feedback.vehicles, plane);
        }
    }

    /// Constrains the scale by the road measurement of the last processed frame. The first measurement of a segment sets the
    /// height that is held; later ones measure how far the odometry's unit has drifted since.
    pub fn constrain_scale(&mut self, measured: &RoadMeasurement) {
        if !self.options.advanced.window.road_scale {
            return;
        }
        let options = self.options.advanced.feedback;
        let log_inverse_height = measured.state.log_inverse_height;
        let held = *self.held_log_height.get_or_insert(-log_inverse_height);
        let change = (log_inverse_height + held).abs();
        if self.unit_is_lost(measured.frame, change) {
            self.renew_map(measured.frame);
            return;
        }
        if change > options.most_height_change {
            return;
        }
        let sigma = (measured.covariance[(0, 0)] + options.height_sigma * options.height_sigma).sqrt();
        if let Some(newest) = self.window.newest_mut() {
            newest.baseline.add(-log_inverse_height - held, sigma);
        }
        if measured.covariance[(1, 1)].sqrt() < options.most_pitch_sigma_rad {
            self.constrain_plane(measured, held);
        }
    }

    /// True when the road has contradicted the unit for so long that no later measurement would be admitted to correct it; `change` is
    /// that of log height against the held one.
    fn unit_is_lost(&mut self, frame: usize, change: f64) -> bool {
        let options = &self.options.advanced.feedback;
        let Some(now_ns) = self.trajectory.frames.get(frame).map(|f| f.timestamp_ns) else { return false };
        if change <= options.most_unit_change {
            self.contradicted_since_ns = None;
            return false;
        }
        let since_ns = *self.contradicted_since_ns.get_or_insert(now_ns);
        now_ns - since_ns >= nanoseconds(options.unit_lost_s)
    }

    /// Gives the newest keyframe the road plane of the first measurement at or after it: the measured tilt, the held height. With
    /// the measured height one false alignment would change the unit, and the next one with it.
    fn constrain_plane(&mut self, measured: &RoadMeasurement, held: f64) {
        let Some(camera_from_world) = self.trajectory.camera_from_world(measured.frame) else { return };
        let Some(newest) = self.window.newest_mut().filter(|k| k.plane.is_none()) else { return };
        // mᵀ(R X + t) = 1 in the keyframe's camera: m' = Rᵀm / (1 − mᵀt).
        let moved = camera_from_world * newest.camera_from_world.inverse();
        let m = -road_normal(measured.state.pitch_rad, measured.state.roll_rad) * (-held).exp();
        let along = 1.0 - m.dot(&moved.translation());
        let least = 1.0 - self.options.advanced.feedback.most_climb_heights;
        newest.plane = (along > least).then(|| moved.rotation_matrix().tr_mul(&m) / along);
    }
}
