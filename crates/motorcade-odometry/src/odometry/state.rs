//! All that the odometry knows between two frames, to be kept in a file.

use std::collections::VecDeque;

use motorcade_geometry::PinholeCamera;
use serde::{Deserialize, Serialize};

use super::initialisation::Initialisation;
use super::picture_shifts::ShiftedFrame;
use super::scratch::Scratch;
use super::velocity::Velocity;
use super::{LastFrame, Odometry, OdometryOptions, Standstill};
use crate::map::{Keyframe, Landmark, Window};
use crate::tracking::PyramidPool;
use crate::trajectory::OdometryTrajectory;

/// State of an [`Odometry`] after a frame, without camera and options. An odometry made of it gives the same bits for the frames to come.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OdometryState {
    trajectory: OdometryTrajectory,
    keyframes: VecDeque<Keyframe>,
    landmarks: Vec<Landmark>,
    corners: u64,
    initialisation: Option<Initialisation>,
    last: Option<LastFrame>,
    velocity: Velocity,
    failing_ns: i64,
    standstill: Standstill,
    held_log_height: Option<f64>,
    contradicted_since_ns: Option<i64>,
    renewals: Vec<usize>,
    shifted: Vec<ShiftedFrame>,
}

impl OdometryState {
    /// The frames so far; records that were taken out are not among them.
    pub fn trajectory(&self) -> &OdometryTrajectory {
        &self.trajectory
    }
}

impl Odometry {
    /// The state after the last frame.
    pub fn state(&self) -> OdometryState {
        // A field that is new does not compile here until it is kept or known to be no state.
        let Self {
            camera: _,
            options: _,
            trajectory,
            window,
            corners,
            initialisation,
            last,
            velocity,
            failing_ns,
            standstill,
            held_log_height,
            contradicted_since_ns,
            renewals,
            shifted,
            pyramids: _,
            scratch: _,
        } = self;
        let (keyframes, landmarks) = window.state();
        OdometryState {
            trajectory: trajectory.clone(),
            keyframes: keyframes.clone(),
            landmarks: landmarks.clone(),
            corners: *corners,
            initialisation: initialisation.clone(),
            last: last.clone(),
            velocity: *velocity,
            failing_ns: *failing_ns,
            standstill: *standstill,
            held_log_height: *held_log_height,
            contradicted_since_ns: *contradicted_since_ns,
            renewals: renewals.clone(),
            shifted: shifted.clone(),
        }
    }

    /// Ready for the frame after a state, with the camera and the options that it came from.
    pub fn from_state(camera: PinholeCamera, options: OdometryOptions, state: OdometryState) -> Self {
        let OdometryState {
            trajectory,
            keyframes,
            landmarks,
            corners,
            initialisation,
            last,
            velocity,
            failing_ns,
            standstill,
            held_log_height,
            contradicted_since_ns,
            renewals,
            shifted,
        } = state;
        let mut scratch = Scratch::default();
        scratch.make_room(landmarks.len());
        Self {
            camera,
            options,
            trajectory,
            window: Window::from_state(options.advanced.window, keyframes, landmarks),
            corners,
            initialisation,
            last,
            velocity,
            failing_ns,
            standstill,
            held_log_height,
            contradicted_since_ns,
            renewals,
            shifted,
            pyramids: PyramidPool::default(),
            scratch,
        }
    }
}
