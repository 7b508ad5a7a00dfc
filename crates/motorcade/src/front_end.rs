//! The pass over the frames: perception, the camera's motion up to scale, the road.

use std::sync::mpsc::sync_channel;

use motorcade_dataset::{BadFrame, Frame, Sequence};
use motorcade_geometry::{BoundingBox, PinholeCamera};
use motorcade_odometry::{
    Odometry, OdometryOptions, OdometryTrajectory, RoadInput, RoadMeasurement, StaticMask,
};
use motorcade_perception::{Detection, Perception, Percepts};

use crate::config::{Config, VehicleMask};
use crate::error::{Error, Result};
use crate::motion_source::{ExternalTrajectory, MotionSource};
use crate::pipeline::External;
use crate::progress::Progress;
use crate::result::FrameInfo;
use crate::scale_source::ScaleSource;
use crate::timing::Stopwatch;

/// What the pass over the frames leaves; all that the stages after it look at.
#[derive(Clone, Debug)]
pub struct FrontEnd {
    /// Intrinsics of the (undistorted) frames.
    pub camera: PinholeCamera,
    /// Frames, in order.
    pub frames: Vec<FrameInfo>,
    /// Detections of each frame.
    pub detections: Vec<Vec<Detection>>,
    /// False when nobody looked for vehicles.
    pub looked_for_vehicles: bool,
    /// The camera's motion.
    pub motion: OdometryTrajectory,
    /// True when its unit is the metre.
    pub metric: bool,
    /// What the frames say about road and scale.
    pub road_measurements: Vec<RoadMeasurement>,
    /// Times.
    pub stopwatch: Stopwatch,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// True when it was stopped before the last frame.
    pub interrupted: bool,
}

/// What is known after a frame: all frames up to it.
#[derive(Clone, Copy)]
pub struct FrontEndView<'a> {
    /// Frames.
    pub frames: &'a [FrameInfo],
    /// Detections of each frame.
    pub detections: &'a [Vec<Detection>],
    /// The camera's motion; of a given trajectory it may hold frames that have not come yet.
    pub motion: &'a OdometryTrajectory,
    /// What the frames said about road and scale.
    pub road_measurements: &'a [RoadMeasurement],
}

/// Is told of every frame while the pass goes on.
pub type Watch<'a> = &'a mut dyn FnMut(&FrontEndView<'_>);

impl FrontEnd {
    /// Passes over a sequence. `threads` ≥ 2 lets perception work ahead on a thread of its own; results do not depend on it.
    /// `watch` is told of every frame.
    ///
    /// # Errors
    /// Perception that fails as such (a network that does not run). A frame that does not read is bridged, not an error.
    pub fn pass(
        sequence: &Sequence,
        perception: &Perception,
        given: &External,
        config: &Config,
        threads: usize,
        progress: &dyn Progress,
        watch: Watch<'_>,
    ) -> Result<Self> {
        let mut pass = Pass::new(sequence.camera()?, given, config);
        progress.begin("odometry", Some(sequence.len()));
        let mut interrupted = false;
        let mut take = |perceived: Result<Perceived>| -> Result<bool> {
            pass.step(perceived?, config, progress);
            watch(&pass.so_far());
            progress.advance(pass.frames.len());
            interrupted = progress.cancelled();
            Ok(!interrupted)
        };
        if threads < 2 {
            for frame in sequence.frames() {
                if !take(perceive(perception, frame))? {
                    break;
                }
            }
        } else {
            std::thread::scope(|scope| -> Result<()> {
                let (sender, receiver) = sync_channel(4);
                scope.spawn(move || {
                    for frame in sequence.frames() {
                        // The receiver has gone: the run was stopped.
                        if sender.send(perceive(perception, frame)).is_err() {
                            break;
                        }
                    }
                });
                for perceived in receiver {
                    if !take(perceived)? {
                        break;
                    }
                }
                Ok(())
            })?;
        }
        let looked_for_vehicles = perception.looks_for_vehicles() || given.vehicles.is_some();
        Ok(Self { looked_for_vehicles, interrupted, ..pass.finish(given) })
    }

    /// Where no frames are: `given` must hold a trajectory.
    ///
    /// # Errors
    /// A trajectory that is missing or of another length.
    pub fn without_frames(
        input: FramelessInput,
        given: &External,
        config: &Config,
        watch: Watch<'_>,
    ) -> Result<Self> {
        let fits = |t: &ExternalTrajectory| t.world_from_camera.len() == input.frames.len();
        if !given.trajectory.as_ref().is_some_and(fits) {
            let text = "without frames the camera trajectory must be given, a pose a frame";
            return Err(Error::Config(text.to_owned()));
        }
        let mut pass = Pass::new(input.camera, given, config);
        let mut detections = input.detections.into_iter();
        for frame in input.frames {
            pass.frames.push(frame);
            pass.detections.push(detections.next().unwrap_or_default());
            watch(&pass.so_far());
        }
        Ok(Self { looked_for_vehicles: true, ..pass.finish(given) })
    }
}

/// A run without any pixel: frames by number and time, detections and a camera trajectory from files.
#[derive(Clone, Debug)]
pub struct FramelessInput {
    /// Intrinsics.
    pub camera: PinholeCamera,
    /// Frames.
    pub frames: Vec<FrameInfo>,
    /// Detections of each frame.
    pub detections: Vec<Vec<Detection>>,
}

/// One frame on its way from perception to odometry.
type Perceived = (std::result::Result<Frame, BadFrame>, Percepts, f64);

fn perceive(perception: &Perception, frame: std::result::Result<Frame, BadFrame>) -> Result<Perceived> {
    let start = std::time::Instant::now();
    let percepts = match &frame {
        Ok(frame) => perception.perceive(frame)?,
        Err(_) => Percepts::default(),
    };
    Ok((frame, percepts, start.elapsed().as_secs_f64() * 1e3))
}

/// State of the pass between frames.
struct Pass {
    camera: PinholeCamera,
    motion: MotionSource,
    scale: ScaleSource,
    frames: Vec<FrameInfo>,
    detections: Vec<Vec<Detection>>,
    stopwatch: Stopwatch,
    warnings: Vec<String>,
}

impl Pass {
    fn new(camera: PinholeCamera, given: &External, config: &Config) -> Self {
        let motion = match &given.trajectory {
            Some(trajectory) => MotionSource::External(trajectory.up_to_scale()),
            None => MotionSource::Own(Box::new(Odometry::new(
                camera,
                OdometryOptions { seed: config.run.seed, ..config.odometry },
            ))),
        };
        Self {
            camera,
            motion,
            scale: ScaleSource::new(camera, config),
            frames: Vec::new(),
            detections: Vec::new(),
            stopwatch: Stopwatch::default(),
            warnings: Vec::new(),
        }
    }

    /// One frame: perception's boxes mask the scene, the camera moves, the road is measured.
    fn step(
        &mut self,
        (frame, percepts, perception_ms): Perceived,
        config: &Config,
        progress: &dyn Progress,
    ) {
        let frame = match frame {
            Ok(frame) => frame,
            Err(bad) => {
                self.motion.skip();
                self.detections.push(Vec::new());
                let message = format!("{bad}; its pose is bridged");
                progress.warn(&message);
                self.warnings.push(message);
                let problem = Some(bad.reason.to_string());
                self.frames.push(FrameInfo { number: bad.number, timestamp_ns: bad.timestamp_ns, problem });
                return;
            }
        };
        self.stopwatch.add("perception", perception_ms);
        let index = self.frames.len();
        let boxes: Vec<BoundingBox> =
            percepts.detections.iter().filter(|d| d.score >= MASKING_SCORE).map(|d| d.bbox).collect();
        let masked: &[BoundingBox] = if config.run.vehicle_mask == VehicleMask::None { &[] } else { &boxes };
        let boxes_may_stand = config.run.vehicle_mask == VehicleMask::Moving;
        let mask = StaticMask { boxes: masked, boxes_may_stand, ignore: frame.ignore.as_ref() };
        let gray = frame.gray();
        let pyramid = self.stopwatch.time("odometry", || self.motion.process(&gray, &mask));
        let so_far = self.motion.so_far();
        // Vehicles hide the road whether they move or not.
        let hidden = StaticMask { boxes: &boxes, boxes_may_stand: false, ignore: frame.ignore.as_ref() };
        let road = percepts.road.as_ref().filter(|_| config.run.road_mask);
        let usable = |p: &nalgebra::Point2<f64>| hidden.allows(p) && road.is_none_or(|r| r.is_road(p.x, p.y));
        let (scale, segment) = (&mut self.scale, so_far.frames[index].segment);
        let sight = RoadInput { pyramid: &pyramid, vehicles: &boxes, masked: road.is_some() };
        self.stopwatch.time("road", || scale.process(index, segment, &sight, so_far, usable));
        if let Some(measured) = self.scale.measurements().last().filter(|m| m.frame == index) {
            self.motion.constrain_scale(measured);
        }
        if let Some(plane) = self.scale.plane().filter(|_| boxes_may_stand) {
            self.motion.classify_static_vehicles(&boxes, &plane);
        }
        self.frames.push(FrameInfo { number: frame.number, timestamp_ns: frame.timestamp_ns, problem: None });
        self.detections.push(percepts.detections);
    }

    fn so_far(&self) -> FrontEndView<'_> {
        FrontEndView {
            frames: &self.frames,
            detections: &self.detections,
            motion: self.motion.so_far(),
            road_measurements: self.scale.measurements(),
        }
    }

    fn finish(self, given: &External) -> FrontEnd {
        FrontEnd {
            camera: self.camera,
            motion: self.motion.finish(self.frames.len()),
            metric: given.trajectory.as_ref().is_some_and(|t| t.metric),
            road_measurements: self.scale.measurements().to_vec(),
            frames: self.frames,
            detections: self.detections,
            looked_for_vehicles: false,
            stopwatch: self.stopwatch,
            warnings: self.warnings,
            interrupted: false,
        }
    }
}

/// A box less certain than this masks nothing: it is more often a shadow than a vehicle.
const MASKING_SCORE: f64 = 0.3;
