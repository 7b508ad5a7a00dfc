//! Frames whose picture is shifted as a whole.

use nalgebra::Vector2;

use super::{CameraFromWorld, Odometry};
use crate::map::{Observation, PoseEstimate, picture_shift};

/// A frame from which on the picture is shifted.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ShiftedFrame {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// Shift against the frames before \[px\], x right, y down.
    pub shift_px: Vector2<f64>,
}

impl Odometry {
    /// Looks for a shift where the camera turns otherwise than predicted: elsewhere there is none.
    pub(super) fn note_shift(
        &mut self,
        frame: usize,
        predicted: &CameraFromWorld,
        estimate: &PoseEstimate,
        observations: &[Observation],
    ) {
        let options = &self.options.advanced.picture_shift;
        let turn = estimate.camera_from_world.rotation() * predicted.rotation().inverse();
        if self.camera.fx.max(self.camera.fy) * turn.angle() < 0.5 * options.least_px {
            return;
        }
        let pose = &self.options.advanced.pose;
        let noise_px = estimate.inlier_rms_px.clamp(pose.least_sigma_px, pose.inlier_px);
        let poses = (predicted, &estimate.camera_from_world);
        let found = picture_shift(&self.camera, poses, observations, noise_px, pose.kernel_px, options);
        self.shifted.extend(found.map(|shift_px| ShiftedFrame { frame, shift_px }));
    }
}
