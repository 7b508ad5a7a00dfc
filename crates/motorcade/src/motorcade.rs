//! The object that takes frames.

mod builder;
mod state;

use std::borrow::Cow;

use image::GrayImage;
use motorcade_dataset::{Frame, MOST_IN_FRAME};
use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, FixedRegions, Observations, Perception};

pub use builder::MotorcadeBuilder;
pub(crate) use state::Resumed;

use crate::error::{Error, Result};
use crate::estimate::Estimate;
use crate::estimator::{SlidingEstimator, estimate_drive};
use crate::fixed_parts::FixedParts;
use crate::front_end::FrontEnd;
use crate::picture_faults::PictureFaults;
use crate::progress::{NoProgress, Progress};
use crate::record::{FrameInfo, FrontEndRecord};
use crate::repeated_frames::RepeatedFrames;
use crate::result::RunResult;
use crate::revision::Revision;
use crate::settings::Settings;

/// Monocular multi-body SLAM on the frames of one camera.
///
/// [`step`](Self::step) takes an image and returns camera and vehicles as they are known then; [`finish`](Self::finish)
/// estimates the whole drive once more with everything. Both are the same estimator, over the last seconds and over the drive.
/// Poses are `world_from_camera` and `world_from_vehicle` in metres; the world is the camera of the first frame.
///
/// ```
/// use motorcade::Motorcade;
/// use motorcade::dataset::Frame;
/// use motorcade::geometry::PinholeCamera;
///
/// let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 160.0, cy: 80.0, width: 320, height: 160 };
/// let mut slam = Motorcade::builder(camera).height_m(1.65).build()?;
/// for k in 0..3 {
///     let image = image::GrayImage::new(320, 160);
///     let now = slam.step(&Frame::from_gray(image, k * 100_000_000))?;
///     println!("{:.1} m/s, {} vehicles", now.speed_mps, now.vehicles.len());
/// }
/// let drive = slam.finish();
/// assert_eq!(drive.ego.frames.len(), 3);
/// # Ok::<(), motorcade::Error>(())
/// ```
pub struct Motorcade {
    settings: Settings,
    perception: Perception,
    front_end: FrontEnd,
    fixed: FixedParts,
    repeated: RepeatedFrames,
    pictures: PictureFaults,
    sliding: SlidingEstimator,
    /// Hash of the picture of the last row, where it had one.
    last_picture: Option<String>,
    /// The rows that are not to be taken again, until the first one after them.
    resumed: Option<Resumed>,
}

impl Motorcade {
    /// A builder for a camera.
    pub fn builder(camera: PinholeCamera) -> MotorcadeBuilder {
        MotorcadeBuilder::new(camera)
    }

    /// Settings of the drive.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Takes the next frame and estimates camera, road and vehicles in it.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn step(&mut self, frame: &Frame) -> Result<Estimate> {
        self.push(frame)?;
        self.estimate().ok_or_else(|| Error::Input(format!("frame {}: no estimate", frame.number)))
    }

    /// Takes the next frame without estimating the last seconds: for drives that are only wanted as a whole.
    ///
    /// # Errors
    /// An image of another size than the camera's, a timestamp that is not after the one before, a detector that fails. The
    /// frame is then not taken; [`skip`](Self::skip) keeps its row.
    pub fn push(&mut self, frame: &Frame) -> Result<()> {
        self.check(frame)?;
        let start = std::time::Instant::now();
        let observations = self.perception.observe(frame)?;
        self.push_observed(frame, observations, start.elapsed().as_secs_f64() * 1e3)
    }

    /// As [`push`](Self::push), with observations made elsewhere in `perception_ms` milliseconds.
    ///
    /// # Errors
    /// An image of another size than the camera's, a timestamp that is not after the one before, more than 1000 boxes.
    pub fn push_observed(
        &mut self,
        frame: &Frame,
        mut observations: Observations,
        perception_ms: f64,
    ) -> Result<()> {
        self.check(frame)?;
        for (what, count) in
            [("boxes", observations.detections.len()), ("keypoint sets", observations.keypoints.len())]
        {
            if count > MOST_IN_FRAME {
                let problem =
                    format!("frame {}: {count} {what}, at most {MOST_IN_FRAME} are taken", frame.number);
                return Err(Error::Input(problem));
            }
        }
        self.add_external_keypoints(frame.number, &mut observations);
        self.last_picture = Some(state::picture_hash(frame));
        let Self { front_end, fixed, repeated, pictures, settings, .. } = self;
        let gray = frame.gray();
        if fixed.searching() {
            fixed.observe(&gray, frame.timestamp_ns, &settings.camera);
        }
        front_end.record_mut().stopwatch.add("perception", perception_ms);
        if let Some(repetition) = repeated.repetition(&gray, frame.timestamp_ns) {
            front_end.skip(frame.number, frame.timestamp_ns, repetition.problem().to_owned());
            front_end.bridge_repeated(repeated.repeat_the_first());
            return Ok(());
        }
        let frame: &Frame = &at_its_time(frame, repeated.taken_ns());
        let checks = &settings.config.checks.advanced.pictures;
        front_end.record_mut().stopwatch.time("picture checks", || {
            pictures.observe(&gray, frame.number, frame.timestamp_ns, checks);
        });
        let vehicles: Vec<BoundingBox> = observations.detections.iter().map(|d| d.bbox).collect();
        fixed.observe_vehicles(&vehicles);
        let ignore = fixed.with(frame.ignore.as_ref());
        front_end.process(frame, ignore.as_deref(), observations, settings);
        Ok(())
    }

    /// Looks for what is fixed to the camera (bonnet, reflections, dirt) in frames from all over the drive, so that it is left
    /// out from the first frame on. Without this call it is looked for while the camera drives.
    pub fn survey<'a>(&mut self, images: impl IntoIterator<Item = Cow<'a, GrayImage>>) {
        if !self.settings.config.run.fixed_regions {
            return;
        }
        let mut regions = FixedRegions::new(self.settings.config.perception.advanced.fixed);
        for image in images {
            regions.observe(&image);
        }
        self.fixed.settle(regions.mask(&self.settings.camera));
    }

    /// Takes a frame of which there is no image, on an external trajectory.
    ///
    /// # Errors
    /// No external trajectory, or one that ends before this frame; a timestamp that is not after the one before.
    pub fn push_without_image(&mut self, frame: FrameInfo, mut observations: Observations) -> Result<()> {
        self.check_time(frame.number, frame.timestamp_ns)?;
        let row = self.front_end.len();
        let trajectory = self.settings.external.trajectory.as_ref();
        if trajectory.is_none_or(|t| t.world_from_camera.len() <= row) {
            let text = "without frames the camera trajectory must be given, a pose a frame";
            return Err(Error::Config(text.to_owned()));
        }
        self.add_external_keypoints(frame.number, &mut observations);
        self.front_end.process_without_image(frame, observations);
        Ok(())
    }

    /// Takes a frame that is missing or unreadable, for this reason: its pose is bridged and its row stays.
    ///
    /// # Errors
    /// A timestamp that is not after the one before.
    pub fn skip(&mut self, number: u64, timestamp_ns: i64, problem: &str) -> Result<()> {
        self.check_time(number, timestamp_ns)?;
        self.last_picture = None;
        self.front_end.skip(number, timestamp_ns, problem.to_owned());
        let warning = format!("frame {number}: {problem}; its pose is bridged");
        self.front_end.record_mut().warnings.push(warning);
        Ok(())
    }

    /// The estimate of the newest frame, from it and the frames before it; `None` before the first.
    pub fn estimate(&mut self) -> Option<Estimate> {
        let Self { sliding, front_end, settings, .. } = self;
        if sliding.is_empty() {
            front_end.bring_back(&NoProgress);
        }
        // Frames that were pushed since the last estimate are taken one by one.
        while sliding.len() < front_end.len() {
            sliding.advance(&front_end.view(sliding.len() + 1), settings);
        }
        let needed = sliding.put_away(&front_end.view(front_end.len()), settings);
        front_end.forget_before(needed);
        front_end.forget_places(sliding.places_done(settings));
        sliding.newest(&front_end.view(front_end.len()))
    }

    /// Corrections of an online run by places seen again, since the last call: [`estimate`](Self::estimate) returns frames from
    /// [`Revision::frame`] on in the corrected world. None without places seen again, or where `online.enabled` is false.
    pub fn take_revisions(&mut self) -> Vec<Revision> {
        self.sliding.take_revisions()
    }

    /// Ends the drive and estimates it as a whole. With `online.enabled`, once frames were estimated, as [`finish_online`](Self::finish_online):
    /// the motion of earlier frames is then forgotten.
    pub fn finish(self) -> RunResult {
        self.finish_with(&NoProgress)
    }

    /// As [`finish`](Self::finish), reporting progress and warnings.
    pub fn finish_with(mut self, progress: &dyn Progress) -> RunResult {
        if self.front_end.record().forgotten {
            return self.finish_online(progress);
        }
        self.note_pictures(progress);
        estimate_drive(self.front_end.finish(progress), &self.settings, progress)
    }

    /// Ends the drive; every frame stays as it was estimated when it came. Frames without an estimate get theirs now.
    pub fn finish_online(mut self, progress: &dyn Progress) -> RunResult {
        self.estimate();
        self.note_pictures(progress);
        self.sliding.finish(self.front_end.finish(progress), &self.settings, progress)
    }

    /// Ends the pass over the frames: the output of the front end and the settings, for
    /// [`estimate_drive`](crate::estimate_drive) with several configurations.
    pub fn into_record(mut self) -> (FrontEndRecord, Settings) {
        self.note_pictures(&NoProgress);
        (self.front_end.finish(&NoProgress), self.settings)
    }

    /// Notes what was found out about the pictures themselves.
    fn note_pictures(&mut self, progress: &dyn Progress) {
        let found: Vec<String> = self
            .fixed
            .describe()
            .into_iter()
            .chain(self.repeated.describe())
            .chain(self.pictures.describe())
            .chain(self.front_end.describe_shifts())
            .chain(self.front_end.describe_renewals())
            .chain(self.front_end.describe_mirror())
            .chain(self.front_end.check_focal_length(&self.settings.config.checks.advanced.focal_length))
            .collect();
        found.iter().for_each(|text| progress.warn(text));
        let fixed_regions = self.fixed.regions();
        let record = self.front_end.record_mut();
        record.fixed_regions = fixed_regions;
        record.warnings.extend(found);
    }

    /// Warnings so far: settings that are rarely meant, frames that were skipped.
    pub fn warnings(&self) -> &[String] {
        &self.front_end.record().warnings
    }

    /// Adds a warning to those of the results.
    pub(crate) fn warn(&mut self, warning: String) {
        self.front_end.record_mut().warnings.push(warning);
    }

    /// The detectors, to be run elsewhere; none stay.
    pub(crate) fn take_perception(&mut self) -> Perception {
        std::mem::take(&mut self.perception)
    }
    /// Marks the drive as stopped before the last of its frames, of which there are `planned` where that is known.
    pub fn interrupt(&mut self, planned: impl Into<Option<usize>>) {
        let record = self.front_end.record_mut();
        record.interrupted = true;
        record.planned_frames = planned.into();
    }
    /// As [`interrupt`](Self::interrupt), by a fault of the program.
    pub(crate) fn fail(&mut self, planned: Option<usize>, problem: String) {
        self.interrupt(planned);
        self.front_end.record_mut().failed = true;
        self.warn(problem);
    }
    /// Makes room for the frames of a drive.
    pub(crate) fn reserve(&mut self, frames: usize) {
        self.front_end.record_mut().reserve(frames);
    }
    /// Number of frames taken, those that did not read among them.
    pub fn frames(&self) -> usize {
        self.front_end.len()
    }

    fn add_external_keypoints(&self, number: u64, observations: &mut Observations) {
        if let Some(table) = &self.settings.external.keypoints {
            observations.keypoints.extend_from_slice(table.of_frame(number));
        }
    }

    fn check(&self, frame: &Frame) -> Result<()> {
        let (camera, (width, height)) = (&self.settings.camera, frame.size());
        if (width, height) != (camera.width, camera.height) {
            return Err(Error::Input(format!(
                "frame {}: the image has {width}×{height} px, the camera {}×{}; calibrate for this size",
                frame.number, camera.width, camera.height
            )));
        }
        self.check_time(frame.number, frame.timestamp_ns)
    }

    fn check_time(&self, number: u64, timestamp_ns: i64) -> Result<()> {
        let before = self.front_end.newest().map(|f| f.timestamp_ns);
        if let Some(before) = before.filter(|b| *b >= timestamp_ns) {
            return Err(Error::Input(format!(
                "frame {number}: its time {timestamp_ns} ns is not after that of the frame before, {before} ns"
            )));
        }
        Ok(())
    }
}

/// A frame at the time at which its picture was taken \[ns\].
fn at_its_time(frame: &Frame, taken_ns: i64) -> Cow<'_, Frame> {
    if frame.timestamp_ns == taken_ns {
        return Cow::Borrowed(frame);
    }
    Cow::Owned(Frame { timestamp_ns: taken_ns, ..frame.clone() })
}
