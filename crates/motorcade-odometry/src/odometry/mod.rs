//! Monocular odometry up to scale: corners followed by KLT, pose against the local map, keyframes, windowed bundle
//! adjustment. A break starts a new segment with a scale of its own.

mod frame_tracking;
mod initialisation;
mod options;
mod road_feedback;
mod static_vehicles;

pub use options::{OdometryOptions, PolicyOptions};

use std::sync::Arc;

use image::GrayImage;
use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use nalgebra::{Matrix6, Point2};

use crate::buffer::make_room;
use crate::map::Landmark;
use crate::map::NearbyDepths;
use crate::map::Window;
use crate::map::{Observation, PoseEstimate, PoseRefiner};
use crate::tracking::Pyramid;
use crate::tracking::PyramidPool;
use crate::tracking::StaticMask;
use crate::trajectory::{FrameRecord, FrameStatus, OdometryTrajectory, fill};
use initialisation::Beginning;

type CameraFromWorld = Pose<Camera, World>;
type CameraFromCamera = Pose<Camera, Camera>;

/// The odometry; frames go in one by one.
pub struct Odometry {
    camera: PinholeCamera,
    options: OdometryOptions,
    out: OdometryTrajectory,
    window: Window,
    beginning: Option<Beginning>,
    /// Last frame whose tracks hold: its number, pyramid and pose.
    last: Option<(usize, Arc<Pyramid>, CameraFromWorld)>,
    /// Motion per frame interval, `camera_from_camera` of the last tracked pair.
    velocity: CameraFromCamera,
    failures: usize,
    /// Logarithm of the camera's height that the segment's unit is held to.
    held_height: Option<f64>,
    pyramids: PyramidPool,
    scratch: Scratch,
}

/// Memory of one frame's work, kept for the next: a frame that becomes no keyframe takes none.
#[derive(Default)]
struct Scratch {
    /// New pixel of every landmark, `None` where lost \[px\].
    pixels: Vec<Option<Point2<f64>>>,
    /// What the pose is refined by.
    observations: Vec<Observation>,
    /// What a median or quantile is taken of: image motions \[px\], depths.
    values: Vec<f64>,
    /// Index of the box that each landmark lies in.
    owners: Vec<Option<usize>>,
    depths: NearbyDepths,
    refiner: PoseRefiner,
}

impl Scratch {
    /// Room for the landmarks a keyframe has left, before a frame that is none asks for it.
    fn make_room(&mut self, landmarks: usize) {
        make_room(&mut self.pixels, landmarks);
        make_room(&mut self.observations, landmarks);
        make_room(&mut self.values, landmarks);
        make_room(&mut self.owners, landmarks);
        self.depths.make_room(landmarks);
        self.refiner.make_room(landmarks);
    }
}

const PYRAMID_LEVELS: usize = 4;

impl Odometry {
    /// Ready for the first frame.
    pub fn new(camera: PinholeCamera, options: OdometryOptions) -> Self {
        Self {
            camera,
            options,
            out: OdometryTrajectory { frames: Vec::new(), keyframes: Vec::new() },
            window: Window::new(options.window),
            beginning: None,
            last: None,
            velocity: CameraFromCamera::identity(),
            failures: 0,
            held_height: None,
            pyramids: PyramidPool::default(),
            scratch: Scratch::default(),
        }
    }

    /// Poses so far.
    pub fn so_far(&self) -> &OdometryTrajectory {
        &self.out
    }

    /// The landmarks of the local map.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.window.landmarks
    }

    /// A frame that could not be read: its pose is bridged.
    pub fn skip(&mut self) {
        if self.beginning.is_some() || self.last.is_none() {
            self.beginning = None;
            self.record_initialising();
        } else {
            self.bridge();
        }
    }

    /// Takes the next frame; returns its pyramid for the stages that look at the same pixels. Once nobody holds it, its
    /// memory serves a later frame.
    pub fn process(&mut self, image: &GrayImage, mask: &StaticMask<'_>) -> Arc<Pyramid> {
        let pyramid = self.pyramids.pyramid(image, PYRAMID_LEVELS);
        if self.window.newest().is_none() {
            self.begin(&pyramid, mask);
        } else {
            self.advance(&pyramid, mask);
        }
        self.scratch.make_room(self.window.landmarks.len());
        pyramid
    }

    /// Ends the run: every frame with its final pose.
    pub fn finish(mut self) -> OdometryTrajectory {
        self.close_segment();
        self.out
    }

    // ---- breaks ---------------------------------------------------------------------------------------------------

    fn start_over(&mut self, frame: usize, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
        self.close_segment();
        self.failures = 0;
        self.restart_beginning(frame, pyramid, mask);
        if let Some(record) = self.out.frames.last_mut() {
            record.segment = usize::MAX;
            record.status = FrameStatus::Initialising;
            record.camera_from_keyframe = CameraFromCamera::identity();
        }
    }

    fn close_segment(&mut self) {
        self.window = Window::new(self.options.window);
        self.last = None;
        self.beginning = None;
    }

    // ---- records --------------------------------------------------------------------------------------------------

    fn record_initialising(&mut self) {
        self.out.frames.push(FrameRecord {
            status: FrameStatus::Initialising,
            segment: usize::MAX,
            keyframe: 0,
            camera_from_keyframe: CameraFromCamera::identity(),
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        });
    }

    fn record(&mut self, estimate: &PoseEstimate, pose: CameraFromWorld, status: FrameStatus) {
        let segment = self.out.keyframes.len() - 1;
        let Some(newest) = self.window.newest() else { return };
        let mut record = FrameRecord {
            status,
            segment,
            keyframe: newest.number,
            camera_from_keyframe: (pose * newest.camera_from_world.inverse()).cast(),
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        };
        let kept = record.status;
        fill(&mut record, estimate);
        record.status = kept;
        self.out.frames.push(record);
    }

    fn bridge(&mut self) {
        let before = self.out.frames.last();
        let moved = before.map_or(CameraFromCamera::identity(), |b| self.velocity * b.camera_from_keyframe);
        let (segment, keyframe) = before.map_or((usize::MAX, 0), |b| (b.segment, b.keyframe));
        self.out.frames.push(FrameRecord {
            status: FrameStatus::Bridged,
            segment,
            keyframe,
            camera_from_keyframe: moved,
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        });
    }
}
