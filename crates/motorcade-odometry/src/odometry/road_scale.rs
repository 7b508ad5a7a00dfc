//! The road's say in the bundle adjustment: soft lengths that keep the camera's height, in the odometry's unit, what it was.

use super::Odometry;
use crate::road_measurement::RoadMeasurement;

impl Odometry {
    /// Takes what the road showed in the last processed frame. The first measurement of a segment says what height is held;
    /// after that each one says how far the odometry's unit has drifted since, and the next adjustments give way.
    pub fn constrain_scale(&mut self, measured: &RoadMeasurement) {
        if !self.options.window.road_scale {
            return;
        }
        // value.x is the logarithm of 1 / height.
        let held = *self.held_height.get_or_insert(-measured.value.x);
        let sigma = (measured.covariance[(0, 0)] + FRAME_SIGMA * FRAME_SIGMA).sqrt();
        if let Some(newest) = self.window.newest_mut() {
            newest.road.add(-measured.value.x - held, sigma);
        }
    }
}

/// What a single frame's scale errs by beyond its pixels: the body heaves by 2 cm, the road is not flat. As measured on
/// drives of ours against their truth.
const FRAME_SIGMA: f64 = 0.02;
