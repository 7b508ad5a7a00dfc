//! All that the tracker of the road knows between two frames, to be kept in a file.

use std::collections::VecDeque;

use motorcade_geometry::PinholeCamera;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{MirroredFrames, RoadTracker};
use crate::road::history::{EarlierFrame, RoadHistory};
use crate::road::measurement::RoadMeasurement;
use crate::road::options::RoadOptions;
use crate::road::view::RoadScratch;
use crate::road::watch::{HeightWatch, WatchState};

/// State of a [`RoadTracker`] after a frame, without camera and options. A tracker made of it gives the same bits for the frames to come.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RoadTrackerState {
    history: VecDeque<EarlierFrame>,
    plane: Option<Vector3<f64>>,
    anchor: Option<f64>,
    normal: Vector3<f64>,
    watch: WatchState,
    segment: usize,
    failing_ns: i64,
    lost_ns: i64,
    unmasked_half_width: f64,
    measurements: Vec<RoadMeasurement>,
    mirrored: Option<MirroredFrames>,
}

impl RoadTracker {
    /// The state after the last frame.
    pub fn state(&self) -> RoadTrackerState {
        // A field that is new does not compile here until it is kept or known to be no state.
        let Self {
            camera: _,
            options: _,
            history,
            plane,
            anchor,
            normal,
            watch,
            segment,
            failing_ns,
            lost_ns,
            unmasked_half_width,
            measurements,
            mirrored,
            scratch: _,
        } = self;
        RoadTrackerState {
            history: history.frames().clone(),
            plane: *plane,
            anchor: *anchor,
            normal: *normal,
            watch: watch.state(),
            segment: *segment,
            failing_ns: *failing_ns,
            lost_ns: *lost_ns,
            unmasked_half_width: *unmasked_half_width,
            measurements: measurements.clone(),
            mirrored: *mirrored,
        }
    }

    /// Ready for the frame after a state, with the camera and the options that it came from.
    pub fn from_state(camera: PinholeCamera, options: RoadOptions, state: RoadTrackerState) -> Self {
        let RoadTrackerState {
            history,
            plane,
            anchor,
            normal,
            watch,
            segment,
            failing_ns,
            lost_ns,
            unmasked_half_width,
            measurements,
            mirrored,
        } = state;
        Self {
            camera,
            options,
            history: RoadHistory::of(history),
            plane,
            anchor,
            normal,
            watch: HeightWatch::from_state(options.advanced.height, options.readout_s, watch),
            segment,
            failing_ns,
            lost_ns,
            unmasked_half_width,
            measurements,
            mirrored,
            scratch: RoadScratch::default(),
        }
    }
}
