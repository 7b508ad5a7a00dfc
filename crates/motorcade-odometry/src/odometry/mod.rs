//! Monocular odometry up to scale: corners tracked by KLT, pose against the local map, keyframes, windowed bundle
//! adjustment. A break starts a new segment with a scale of its own.

mod feedback;
mod frame_tracking;
mod initial_poses;
mod initialisation;
mod keyframes;
mod options;
mod picture_shifts;
mod records;
mod scratch;
mod state;
mod static_vehicles;
mod velocity;

use std::ops::Range;
use std::sync::Arc;

use image::GrayImage;
use motorcade_geometry::{Camera, PinholeCamera, Pose, World};

pub use feedback::RoadFeedback;
pub use options::{AdvancedOdometryOptions, FeedbackOptions, OdometryOptions, PolicyOptions};
pub use picture_shifts::ShiftedFrame;
pub use state::OdometryState;

use crate::map::{Landmark, Window};
use crate::rolling_shutter::RowMotion;
use crate::time::nanoseconds;
use crate::tracking::{Pyramid, PyramidPool, StaticMask};
use crate::trajectory::{FrameRecord, OdometryTrajectory};
use initialisation::Initialisation;
use scratch::Scratch;
use velocity::Velocity;

type CameraFromWorld = Pose<Camera, World>;
type CameraFromCamera = Pose<Camera, Camera>;

/// The odometry; frames go in one by one.
pub struct Odometry {
    camera: PinholeCamera,
    options: OdometryOptions,
    trajectory: OdometryTrajectory,
    window: Window,
    /// Corners that became landmarks so far.
    corners: u64,
    initialisation: Option<Initialisation>,
    last: Option<LastFrame>,
    velocity: Velocity,
    /// Time of failed frames in a row \[ns\].
    failing_ns: i64,
    standstill: Standstill,
    /// Logarithm of the camera's height that the segment's unit is held to.
    held_log_height: Option<f64>,
    /// Time since which every measurement of the road has contradicted that height \[ns\].
    contradicted_since_ns: Option<i64>,
    /// Frames after which a new map was started because the unit of the old one was lost.
    renewals: Vec<usize>,
    /// Frames whose picture is shifted as a whole.
    shifted: Vec<ShiftedFrame>,
    pyramids: PyramidPool,
    scratch: Scratch,
}

/// The last frame with valid tracks.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct LastFrame {
    frame: usize,
    timestamp_ns: i64,
    camera_from_world: CameraFromWorld,
    template: TemplateFrame,
}

/// The frame that the templates of tracking are taken from: the last one or, at high frame rates, one a little older. Tracking
/// from frame to frame adds an error per frame, so that fewer links in the chain drift less.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct TemplateFrame {
    timestamp_ns: i64,
    #[serde(with = "crate::tracking::stored")]
    pyramid: Arc<Pyramid>,
    camera_from_world: CameraFromWorld,
}

/// Result of the last standstill test, and the time of its reference pixels.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
struct Standstill {
    stands: bool,
    reference_ns: i64,
}

/// A frame in work.
#[derive(Clone, Copy)]
struct Frame<'a> {
    /// Number of the frame.
    number: usize,
    timestamp_ns: i64,
    pyramid: &'a Arc<Pyramid>,
    mask: &'a StaticMask<'a>,
}

impl Odometry {
    /// Ready for the first frame.
    pub fn new(camera: PinholeCamera, options: OdometryOptions) -> Self {
        Self {
            camera,
            options,
            trajectory: OdometryTrajectory::default(),
            window: Window::new(options.advanced.window),
            corners: 0,
            initialisation: None,
            last: None,
            velocity: Velocity::zero(),
            failing_ns: 0,
            standstill: Standstill::default(),
            held_log_height: None,
            contradicted_since_ns: None,
            renewals: Vec::new(),
            shifted: Vec::new(),
            pyramids: PyramidPool::default(),
            scratch: Scratch::default(),
        }
    }

    /// The options it was made with.
    pub fn options(&self) -> &OdometryOptions {
        &self.options
    }

    /// Poses of all frames so far; bundle adjustment still refines the newest ones.
    pub fn trajectory(&self) -> &OdometryTrajectory {
        &self.trajectory
    }

    /// The landmarks of the local map.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.window.landmarks
    }

    /// Frames after which a new map was started because the unit of length of the old one had drifted away.
    pub fn renewals(&self) -> &[usize] {
        &self.renewals
    }

    /// Frames from which on the picture is shifted against those before as no motion of the camera explains.
    pub fn shifted_frames(&self) -> &[ShiftedFrame] {
        &self.shifted
    }

    /// Takes out the records of frames before `frame` that no later step needs, many at once: those whose poses a map to come may still fill in
    /// stay. Later steps change none of those taken out.
    pub fn forget_before(&mut self, frame: usize) -> Vec<FrameRecord> {
        let begun = self.initialisation.as_ref().map_or(frame, |i| i.first_frame.min(frame));
        let frames = &self.trajectory.frames;
        let unplaced = frames.iter().take(begun.saturating_sub(frames.first_kept())).rev();
        let unplaced = unplaced.take_while(|f| f.segment == usize::MAX).count();
        // The motion to the first of them begins one row before.
        self.trajectory.forget_before((begun - unplaced).saturating_sub(1))
    }

    /// Puts back the records that were taken out.
    pub fn put_back(&mut self, older: Vec<FrameRecord>) {
        self.trajectory.put_back(older);
    }

    /// Records a frame that could not be read; its pose is bridged.
    pub fn skip(&mut self, timestamp_ns: i64) {
        if self.initialisation.is_some() || self.last.is_none() {
            // Corners are not found again after a long gap.
            let longest_ns = nanoseconds(self.options.advanced.policy.give_up_s);
            let newest_ns = self.last.as_ref().map_or(timestamp_ns, |last| last.timestamp_ns);
            self.initialisation.take_if(|_| timestamp_ns - newest_ns > longest_ns);
            self.record_initialising(timestamp_ns);
        } else {
            self.bridge(timestamp_ns);
        }
    }

    /// Takes frames for skipped that were processed before: they showed nothing new. Their poses go evenly from the frame before them to the one after.
    pub fn bridge_rows(&mut self, rows: Range<usize>) {
        if rows.is_empty() {
            return;
        }
        if let Some(initialisation) = &mut self.initialisation {
            initialisation.skip(&rows);
        }
        self.trajectory.bridge(rows);
    }

    /// Processes the next frame; returns its pyramid for the stages that use the same pixels. Once it is dropped, its memory is
    /// reused for a later frame.
    pub fn process(&mut self, timestamp_ns: i64, image: &GrayImage, mask: &StaticMask<'_>) -> Arc<Pyramid> {
        let pyramid = self.pyramids.pyramid(image, self.options.klt.advanced.pyramid_levels);
        let frame = Frame { number: self.trajectory.frames.len(), timestamp_ns, pyramid: &pyramid, mask };
        if self.window.newest().is_none() {
            self.initialise(&frame);
        } else {
            self.track_frame(&frame);
        }
        self.scratch.make_room(self.window.landmarks.len());
        pyramid
    }

    /// Motion from row to row of the newest frame, by the velocity of the last ones.
    fn row_motion(&self) -> RowMotion {
        match self.options.readout_s {
            0.0 => RowMotion::none(),
            readout_s => RowMotion::new(&self.velocity.twist_over(readout_s), &self.camera),
        }
    }

    /// Ends the run; every frame has its final pose.
    pub fn finish(self) -> OdometryTrajectory {
        self.trajectory
    }

    /// Ends the segment with frame `newest`; the next frame starts a map with a unit of its own. A unit that drifts on leaves the range in
    /// which the road is looked for, and no scale would be measured ever again.
    fn renew_map(&mut self, newest: usize) {
        self.window = Window::new(self.options.advanced.window);
        self.failing_ns = 0;
        self.initialisation = None;
        self.renewals.push(newest);
    }

    /// Ends the segment and starts initialisation with this frame.
    fn start_segment(&mut self, frame: &Frame<'_>) {
        self.window = Window::new(self.options.advanced.window);
        self.failing_ns = 0;
        self.restart_initialisation(frame);
        self.mark_newest_initialising();
    }
}
