//! The road's say in the bundle adjustment: soft lengths that keep the camera's height, in the odometry's unit, what it was.

use super::{CameraFromCamera, Odometry};
use crate::road::{RoadMeasurement, road_normal};

impl Odometry {
    /// Takes what the road showed in the last processed frame. The first measurement of a segment says what height is held;
    /// after that each one says how far the odometry's unit has drifted since, and the next adjustments give way.
    pub fn constrain_scale(&mut self, measured: &RoadMeasurement) {
        if !self.options.window.road_scale {
            return;
        }
        // value.x is the logarithm of 1 / height.
        let held = *self.held_height.get_or_insert(-measured.value.x);
        // The unit is held by what was measured before; what says otherwise by so much aligned with something else.
        if (measured.value.x + held).abs() > FARTHEST {
            return;
        }
        let sigma = (measured.covariance[(0, 0)] + FRAME_SIGMA * FRAME_SIGMA).sqrt();
        if let Some(newest) = self.window.newest_mut() {
            newest.road.add(-measured.value.x - held, sigma);
        }
        self.hold_plane(measured, held);
    }
}

impl Odometry {
    /// Gives the newest keyframe the road plane, from the first measurement at or after it: tilted as measured, as far below
    /// as the height that is held. With the measured height one false alignment would drag the unit along, and the next with it.
    fn hold_plane(&mut self, measured: &RoadMeasurement, held: f64) {
        let Some(camera_from_world) = self.out.camera_from_world(measured.frame) else { return };
        let Some(newest) = self.window.newest_mut().filter(|k| k.plane.is_none()) else { return };
        // mᵀ(R X + t) = 1 in the keyframe's camera: m' = Rᵀm / (1 − mᵀt).
        let moved: CameraFromCamera = (camera_from_world * newest.camera_from_world.inverse()).cast();
        let m = -road_normal(measured.value.y, measured.value.z) * (-held).exp();
        let along = 1.0 - m.dot(&moved.translation());
        newest.plane = (along > 0.5).then(|| moved.rotation_matrix().tr_mul(&m) / along);
    }
}

/// What a single frame's scale errs by beyond its pixels: the body heaves by 2 cm, the road is not flat. As measured on
/// drives of ours against their truth.
const FRAME_SIGMA: f64 = 0.02;
/// Change of the logarithm of the height, in a unit that is held, beyond which a measurement is none: seven times its scatter.
const FARTHEST: f64 = 0.15;
