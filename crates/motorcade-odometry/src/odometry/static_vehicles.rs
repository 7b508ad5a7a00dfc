//! Classification of static vehicles by the landmarks on them.
//!
//! Points on a vehicle that moves along with the traffic still fit a static point, only at another depth: the one at which
//! the camera alone would cause their image motion. The road under the vehicle determines the true depth; where both agree
//! the vehicle is static, and its corners are landmarks.

use motorcade_geometry::BoundingBox;
use motorcade_geometry::robust::quantile;
use nalgebra::{Point2, Vector3};

use super::scratch::Scratch;
use super::{FeedbackOptions, Odometry};
use crate::map::{Carrier, Landmark};
use crate::time::nanoseconds;

/// Classification of a vehicle in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MotionClass {
    Static,
    Moving,
    Unknown,
}

impl Odometry {
    /// Classifies the vehicles of the last processed frame. `boxes` are its detections, `plane` the road in the camera frame
    /// (m with `mᵀX = 1`, in the odometry's unit).
    pub fn classify_static_vehicles(&mut self, boxes: &[BoundingBox], plane: &Vector3<f64>) {
        // The nearest vehicle, lowest in the image, occludes those behind it.
        let owner = |p: &Point2<f64>| {
            let around = (0..boxes.len()).filter(|b| boxes[*b].contains(p.x, p.y));
            around.max_by(|a, b| boxes[*a].y2.total_cmp(&boxes[*b].y2))
        };
        let interval_ns = self.newest_interval_ns();
        let mut scratch = std::mem::take(&mut self.scratch);
        let Scratch { owners, values: depths, .. } = &mut scratch;
        let on_vehicle = |l: &Landmark| l.pixel.filter(|_| l.is_on_vehicle());
        owners.clear();
        owners.extend(self.window.landmarks.iter().map(|l| on_vehicle(l).and_then(|p| owner(&p))));
        for (index, bbox) in boxes.iter().enumerate() {
            let own = || owners.iter().enumerate().filter(move |(_, o)| **o == Some(index)).map(|(i, _)| i);
            let landmarks = || own().map(|i| &self.window.landmarks[i]);
            let class = self.motion_class(bbox, landmarks, plane, depths);
            for landmark in own() {
                let carrier = &mut self.window.landmarks[landmark].carrier;
                *carrier = updated(*carrier, class, interval_ns, &self.options.advanced.feedback);
            }
        }
        self.scratch = scratch;
    }

    /// Time between the last two frames \[ns\].
    fn newest_interval_ns(&self) -> i64 {
        match self.trajectory.frames.kept() {
            [.., before, newest] => (newest.timestamp_ns - before.timestamp_ns).max(0),
            _ => 0,
        }
    }

    /// `depths` is scratch.
    fn motion_class<'a, I: Iterator<Item = &'a Landmark>>(
        &self,
        bbox: &BoundingBox,
        landmarks: impl Fn() -> I,
        plane: &Vector3<f64>,
        depths: &mut Vec<f64>,
    ) -> MotionClass {
        let options = &self.options.advanced.feedback;
        let Some(last) = &self.last else { return MotionClass::Unknown };
        let bottom = Point2::new(0.5 * (bbox.x1 + bbox.x2), bbox.y2);
        // Eq. (1): 1/z = mᵀ K⁻¹x.
        let inverse_depth = plane.dot(&self.camera.ray(&bottom));
        let truncated = bbox.y2 > f64::from(self.camera.height) - options.truncated_px;
        if truncated || inverse_depth * options.farthest_vehicle_heights < plane.norm() {
            return MotionClass::Unknown;
        }
        let depth = |l: &Landmark| Some(last.camera_from_world.transform_point(&l.point_in_world?).z);
        depths.clear();
        depths.extend(landmarks().filter_map(depth));
        if depths.len() < options.least_landmarks {
            // Corners that two keyframes observed and that fit no static point belong to a moving object.
            let unfitting = landmarks().filter(|l| l.observations.len() >= 2 && l.point_in_world.is_none());
            let moving = unfitting.count() >= options.least_landmarks;
            return if moving { MotionClass::Moving } else { MotionClass::Unknown };
        }
        let [least, most] = options.static_depth_ratio;
        match quantile(depths, options.near_share) {
            Some(near) if (least..=most).contains(&(near * inverse_depth)) => MotionClass::Static,
            _ => MotionClass::Moving,
        }
    }
}

/// The carrier after one more classification, `interval_ns` after the frame before.
fn updated(carrier: Carrier, class: MotionClass, interval_ns: i64, options: &FeedbackOptions) -> Carrier {
    match (class, carrier) {
        (MotionClass::Moving, _) => Carrier::MovingVehicle { static_ns: 0 },
        (MotionClass::Static, Carrier::MovingVehicle { static_ns }) => {
            let static_ns = static_ns + interval_ns;
            if static_ns >= nanoseconds(options.static_s) {
                Carrier::StaticVehicle
            } else {
                Carrier::MovingVehicle { static_ns }
            }
        }
        _ => carrier,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same time is needed at every frame rate.
    #[test]
    fn a_vehicle_is_static_after_a_time_not_after_a_number_of_frames() {
        let options = FeedbackOptions::default();
        for rate in [5, 10, 25, 50] {
            let interval_ns = 1_000_000_000 / rate;
            let mut carrier = Carrier::MovingVehicle { static_ns: 0 };
            let mut frames = 0;
            while carrier != Carrier::StaticVehicle {
                carrier = updated(carrier, MotionClass::Static, interval_ns, &options);
                frames += 1;
            }
            let needed_s = frames as f64 / rate as f64;
            assert!((0.25..0.25 + 1.0 / rate as f64).contains(&(needed_s + 1e-9)), "{rate}: {needed_s} s");
            assert_eq!(updated(carrier, MotionClass::Unknown, interval_ns, &options), carrier);
            let moving = updated(carrier, MotionClass::Moving, interval_ns, &options);
            assert_eq!(moving, Carrier::MovingVehicle { static_ns: 0 });
        }
    }
}
