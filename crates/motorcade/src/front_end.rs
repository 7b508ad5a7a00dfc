//! The front end: the camera's motion up to scale and the road, frame by frame.

use image::GrayImage;
use motorcade_calibrate::{FocalCheck, FocalCheckOptions};
use motorcade_dataset::Frame;
use motorcade_odometry::{Odometry, OdometryOptions, RoadFeedback, RoadInput, StaticMask};
use motorcade_perception::{BoundingBox, Observations};

use crate::config::VehicleMask;
use crate::frame_list::FrameList;
use crate::motion_source::MotionSource;
use crate::place_recorder::{Candidate, PlaceRecorder};
use crate::plausibility;
use crate::record::{FrameInfo, FrontEndRecord, FrontEndView, known_places};
use crate::scale_source::ScaleSource;
use crate::settings::Settings;

/// State of the front end between frames.
pub(crate) struct FrontEnd {
    motion: MotionSource,
    scale: ScaleSource,
    places: Option<PlaceRecorder>,
    focal: Option<FocalCheck>,
    record: FrontEndRecord,
}

impl FrontEnd {
    pub(crate) fn new(settings: &Settings) -> Self {
        let options = OdometryOptions { seed: settings.config.run.seed, ..settings.config.odometry };
        let motion = match &settings.external.trajectory {
            Some(trajectory) => MotionSource::external(trajectory, &options),
            None => MotionSource::Own(Box::new(Odometry::new(settings.camera, options))),
        };
        Self {
            motion,
            scale: ScaleSource::new(settings.camera, &settings.config),
            places: PlaceRecorder::new(&settings.config, settings.external.trajectory.is_none()),
            // An online run has no end at which the estimate would still help.
            focal: FocalCheck::new(&settings.camera, settings.config.checks.advanced.focal_length)
                .filter(|_| !settings.config.online.enabled),
            record: FrontEndRecord::new(settings),
        }
    }

    /// Takes a frame; nonzero pixels of `ignore` are left out. Boxes mask the scene, the camera moves, the road is measured.
    pub(crate) fn process(
        &mut self,
        frame: &Frame,
        ignore: Option<&GrayImage>,
        mut observations: Observations,
        settings: &Settings,
    ) {
        let Self { motion, scale, places, focal, record } = self;
        let run = &settings.config.run;
        let row = record.frames.len();
        let masking_score = settings.config.perception.masking_score;
        let confident = observations.detections.iter().filter(|d| d.score >= masking_score);
        let boxes: Vec<BoundingBox> = confident.map(|d| d.bbox).collect();
        let masked: &[BoundingBox] = if run.vehicle_mask == VehicleMask::None { &[] } else { &boxes };
        let boxes_may_stand = run.vehicle_mask == VehicleMask::Moving;
        let rim_px = settings.config.odometry.klt.advanced.box_rim_px;
        let mask = StaticMask { boxes: masked, boxes_may_stand, ignore, rim_px };
        let gray = frame.gray();
        let pyramid = record.stopwatch.time("odometry", || motion.process(frame.timestamp_ns, &gray, &mask));

        if let (Some(focal), Some(odometry)) = (focal, motion.odometry()) {
            record.stopwatch.time("focal length", || focal.observe(odometry));
        }

        // Vehicles hide the road whether they move or not.
        let hidden = StaticMask { boxes: &boxes, boxes_may_stand: false, ignore, rim_px };
        let road = observations.road.as_ref().filter(|_| run.road_mask);
        let usable = |p: &nalgebra::Point2<f64>| hidden.allows(p) && road.is_none_or(|r| r.is_road(p.x, p.y));
        let trajectory = motion.trajectory();
        let segment = trajectory.frames[row].segment;
        let input = RoadInput {
            frame: row,
            timestamp_ns: frame.timestamp_ns,
            segment,
            pyramid: &pyramid,
            vehicles: &boxes,
            masked: road.is_some(),
        };
        let measured = record.stopwatch.time("road", || scale.process(&input, trajectory, usable));

        let plane = scale.plane().filter(|_| boxes_may_stand);
        motion.apply_road(&RoadFeedback { measurement: measured.as_ref(), plane, vehicles: &boxes });
        if let Some(places) = places {
            let (trajectory, plane) = (motion.trajectory(), scale.plane());
            let candidate =
                Candidate { row, timestamp_ns: frame.timestamp_ns, image: &gray, trajectory, plane };
            record.stopwatch.time("places", || places.observe(&candidate, |p| hidden.allows(p)));
        }
        if let Some(road) = &observations.road {
            let options = &settings.config.perception.advanced.road_below;
            for detection in &mut observations.detections {
                detection.road_below = road.share_below(&detection.bbox, options, |p| hidden.allows(p));
            }
        }
        record.push(FrameInfo::of(frame), observations);
    }

    /// Takes a frame that is missing or unreadable: its pose is bridged.
    pub(crate) fn skip(&mut self, number: u64, timestamp_ns: i64, problem: String) {
        self.motion.skip(timestamp_ns);
        let info = FrameInfo { number, timestamp_ns, problem: Some(problem) };
        self.record.push(info, Observations::default());
    }

    /// Takes a frame without an image, of which an external trajectory has the pose.
    pub(crate) fn process_without_image(&mut self, info: FrameInfo, observations: Observations) {
        self.motion.skip(info.timestamp_ns);
        self.record.push(info, observations);
    }

    /// Rows so far.
    pub(crate) fn len(&self) -> usize {
        self.record.frames.len()
    }
    pub(crate) fn record(&self) -> &FrontEndRecord {
        &self.record
    }
    pub(crate) fn record_mut(&mut self) -> &mut FrontEndRecord {
        &mut self.record
    }
    /// The last frame taken.
    pub(crate) fn newest(&self) -> Option<&FrameInfo> {
        self.record.frames.last()
    }
    /// Everything known after the first `rows` frames.
    pub(crate) fn view(&self, rows: usize) -> FrontEndView<'_> {
        let measurements = self.scale.measurements();
        let known = measurements.partition_point(|m| m.frame < rows);
        FrontEndView {
            frames: &self.record.frames[..rows],
            detections: &self.record.detections[..rows],
            keypoints: &self.record.keypoints,
            motion: self.motion.trajectory(),
            road_measurements: &measurements[..known],
            places: self.places.as_ref().map_or(&[], |places| known_places(places.keyframes(), rows)),
        }
    }

    /// Forgets of rows before `row` all that results do not list: motion up to scale, measurements of the road, keypoints.
    pub(crate) fn forget_before(&mut self, row: usize) {
        self.motion.forget_before(row);
        self.record.forgotten_measurements += self.scale.forget_before(row);
        drop(self.record.keypoints.forget_before(row));
        self.record.forgotten |= row > 0;
    }

    /// A warning of maps whose unit was lost, for the results.
    pub(crate) fn describe_renewals(&self) -> Option<String> {
        let renewals = self.motion.renewals();
        let first = self.record.frames.get(*renewals.first()?)?.number;
        Some(format!(
            "the odometry lost its unit of length {} times, first in frame {first}, by motion no car has or a road that was not seen for long: \
             new maps were started; speeds shortly before may be wrong",
            renewals.len()
        ))
    }

    /// A warning of a road that mirrors, for the results.
    pub(crate) fn describe_mirror(&self) -> Option<String> {
        let mirrored = self.scale.mirrored()?;
        let first = self.record.frames.get(mirrored.first)?.number;
        Some(format!(
            "the road mirrors what stands above it in {} frames, first in frame {first}: its own texture does not show, and metres there \
             come from points and their mirror images, less exactly",
            mirrored.frames
        ))
    }

    /// A warning of pictures that are shifted as a whole, for the results.
    pub(crate) fn describe_shifts(&self) -> Option<String> {
        let shifted = self.motion.shifted_frames();
        let largest_px = shifted.iter().map(|s| s.shift_px.norm()).fold(0.0, f64::max);
        let mut list = FrameList::default();
        let numbers = shifted.iter().filter_map(|s| Some(self.record.frames.get(s.frame)?.number));
        numbers.for_each(|number| list.push(number));
        let named = list.describe()?;
        Some(format!(
            "the picture is shifted as a whole by up to {largest_px:.0} px, as by another crop and by no motion of the camera, in {named}: \
             the calibration does not hold on one side of each"
        ))
    }

    /// Leaves the focal length unchecked: it came from a drive itself.
    pub(crate) fn trust_focal_length(&mut self) {
        self.focal = None;
    }

    /// A warning of a focal length that the turns of the drive contradict, for the results.
    pub(crate) fn check_focal_length(&mut self, options: &FocalCheckOptions) -> Option<String> {
        let (check, odometry) = (self.focal.take()?, self.motion.odometry()?);
        let stated_px = check.stated_px();
        let found = self.record.stopwatch.time("focal length", || check.finish(odometry))?;
        plausibility::of_focal_length(stated_px, &found, options)
    }

    /// Drops the features of the first `count` keyframes of places, which nobody asks for again.
    pub(crate) fn forget_places(&mut self, count: usize) {
        self.places.iter_mut().for_each(|places| places.forget(count));
    }

    /// Ends the drive.
    pub(crate) fn finish(self) -> FrontEndRecord {
        FrontEndRecord {
            motion: self.motion.finish(),
            road_measurements: self.scale.measurements().to_vec(),
            places: self.places.map(PlaceRecorder::finish).unwrap_or_default(),
            ..self.record
        }
    }
}
