//! The front end: the camera's motion up to scale and the road, frame by frame.

mod state;

use std::io;
use std::ops::Range;

use image::GrayImage;
use motorcade_calibrate::{FocalCheck, FocalCheckOptions};
use motorcade_dataset::Frame;
use motorcade_odometry::{
    FrameRecord, Odometry, OdometryOptions, RoadFeedback, RoadInput, RoadMeasurement, StaticMask,
};
use motorcade_perception::{BoundingBox, Detection, Observations, VehicleKeypoints};
use motorcade_places::PlaceKeyframe;

pub(crate) use state::FrontEndState;

use crate::archive::{Archive, Stored, not_read_back};
use crate::config::VehicleMask;
use crate::focal_by_turns::FocalByTurns;
use crate::frame_list::FrameList;
use crate::motion_source::MotionSource;
use crate::place_recorder::{Candidate, PlaceRecorder};
use crate::plausibility;
use crate::progress::Progress;
use crate::record::{FrameInfo, FrontEndRecord, FrontEndView, known_places};
use crate::repeated_frames::Repetition;
use crate::scale_source::ScaleSource;
use crate::settings::Settings;

/// Keyframes of places that are put away at once.
const PLACES_AT_ONCE: usize = 16;

/// State of the front end between frames.
pub(crate) struct FrontEnd {
    motion: MotionSource,
    scale: ScaleSource,
    places: Option<PlaceRecorder>,
    focal: Option<FocalCheck>,
    record: FrontEndRecord,
    away: PutAway,
    /// True of a drive that is estimated as a whole, which needs all rows at its end.
    whole: bool,
    /// First row that the next estimate of the last seconds reads, where there are such estimates.
    read_from: Option<usize>,
}

/// Rows before those in memory, which only the end of the drive needs.
#[derive(Default)]
struct PutAway {
    motion: Archive<FrameRecord>,
    measurements: Archive<RoadMeasurement>,
    places: Archive<PlaceKeyframe>,
    detections: Archive<Vec<Detection>>,
    keypoints: Archive<Vec<VehicleKeypoints>>,
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
            away: PutAway::default(),
            whole: !settings.config.online.enabled,
            read_from: None,
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
        let Self { motion, scale, places, focal, record, .. } = self;
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
        self.push(FrameInfo::of(frame), observations);
    }

    /// Takes a frame that is missing or unreadable: its pose is bridged.
    pub(crate) fn skip(&mut self, number: u64, timestamp_ns: i64, problem: String) {
        self.motion.skip(timestamp_ns);
        let info = FrameInfo { number, timestamp_ns, problem: Some(problem) };
        self.push(info, Observations::default());
    }

    /// Bridges earlier frames of which it became known that they repeat the one before.
    pub(crate) fn bridge_repeated(&mut self, rows: Range<usize>) {
        for info in self.record.frames.get_mut(rows.clone()).into_iter().flatten() {
            info.problem = Some(Repetition::Repeated.problem().to_owned());
        }
        self.motion.bridge_rows(rows);
    }

    /// Takes a frame without an image, of which an external trajectory has the pose.
    pub(crate) fn process_without_image(&mut self, info: FrameInfo, observations: Observations) {
        self.motion.skip(info.timestamp_ns);
        self.push(info, observations);
    }

    fn push(&mut self, info: FrameInfo, observations: Observations) {
        self.record.push(info, observations);
        if self.whole {
            self.put_away();
        }
    }

    /// Moves what only the end of the drive needs to temporary files.
    fn put_away(&mut self) {
        let newest = self.record.frames.len().saturating_sub(1);
        let needed = self.read_from.into_iter().chain(self.scale.oldest());
        let row = needed.fold(newest, usize::min);
        let Self { motion, scale, places, record, away, .. } = self;
        away.motion.put_away(motion.forget_before(row));
        away.measurements.put_away(scale.forget_before(row));
        away.detections.put_away(record.detections.forget_before(row).collect());
        away.keypoints.put_away(record.keypoints.forget_before(row).collect());
        // Estimates of the last seconds read none.
        if let Some(places) = places {
            away.places.put_away(places.take_out(PLACES_AT_ONCE));
        }
    }

    /// Brings back what was put away; where that cannot be read, the rows stand as frames without pose and vehicles.
    pub(crate) fn bring_back(&mut self, progress: &dyn Progress) {
        let Self { motion, scale, places, record, away, .. } = self;
        let mut problem = None;
        let unplaced = |k: usize| Some(FrameRecord::unplaced(record.frames.get(k)?.timestamp_ns));
        motion.put_back(read(&mut away.motion, &mut problem, unplaced));
        scale.put_back(read(&mut away.measurements, &mut problem, |_| None));
        record.detections.put_back(read(&mut away.detections, &mut problem, |_| Some(Vec::new())));
        record.keypoints.put_back(read(&mut away.keypoints, &mut problem, |_| Some(Vec::new())));
        if let Some(places) = places {
            places.put_back(read(&mut away.places, &mut problem, |_| None));
        }
        if let Some(error) = problem {
            let warning = not_read_back("part of what the frames showed", &error);
            progress.warn(&warning);
            record.warnings.push(warning);
        }
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
            detections: &self.record.detections,
            keypoints: &self.record.keypoints,
            motion: self.motion.trajectory(),
            road_measurements: &measurements[..known],
            places: self.places.as_ref().map_or(&[], |places| known_places(places.keyframes(), rows)),
        }
    }

    /// Estimates of the last seconds read rows from `row` on alone. An online run forgets of those before it all that results do not list: motion up
    /// to scale, measurements of the road, keypoints.
    pub(crate) fn forget_before(&mut self, row: usize) {
        self.read_from = Some(row);
        if self.whole {
            return;
        }
        drop(self.motion.forget_before(row));
        self.record.forgotten_measurements += self.scale.forget_before(row).len();
        drop(self.record.keypoints.forget_before(row));
        self.away.detections.put_away(self.record.detections.forget_before(row).collect());
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

    /// Records the focal length that the turns of the drive say, and warns where they contradict the stated one, for the results.
    pub(crate) fn check_focal_length(&mut self, options: &FocalCheckOptions) -> Option<String> {
        let (check, odometry) = (self.focal.take()?, self.motion.odometry()?);
        let stated_px = check.stated_px();
        let found = self.record.stopwatch.time("focal length", || check.finish(odometry))?;
        let px = found.lens.focal_px;
        let found = FocalByTurns::new(stated_px, px, found.focal_sigma() * px, options);
        self.record.focal_by_turns = Some(found);
        plausibility::of_focal_length(&found)
    }

    /// Drops the features of the first `count` keyframes of places, which nobody asks for again.
    pub(crate) fn forget_places(&mut self, count: usize) {
        self.places.iter_mut().for_each(|places| places.forget(count));
    }

    /// Ends the drive.
    pub(crate) fn finish(mut self, progress: &dyn Progress) -> FrontEndRecord {
        self.bring_back(progress);
        FrontEndRecord {
            motion: self.motion.finish(),
            road_measurements: self.scale.finish(),
            places: self.places.map(PlaceRecorder::finish).unwrap_or_default(),
            ..self.record
        }
    }
}

/// The records of an archive. Where it does not read back, `unknown` of each row stands for its record.
fn read<T: Stored>(
    archive: &mut Archive<T>,
    problem: &mut Option<io::Error>,
    unknown: impl Fn(usize) -> Option<T>,
) -> Vec<T> {
    let rows = 0..archive.len();
    archive.take_back().unwrap_or_else(|error| {
        *problem = Some(error);
        rows.filter_map(unknown).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::external::External;
    use crate::motion_source::ExternalTrajectory;
    use crate::progress::NoProgress;
    use motorcade_geometry::{Camera, Pose, World};
    use motorcade_perception::{BoxConvention, VehicleClass};
    use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M};
    use nalgebra::{UnitQuaternion, Vector3};

    const FRAMES: usize = 700;

    /// A front end after a drive along a given trajectory.
    fn driven(away: PutAway) -> FrontEnd {
        let pose = |k: usize| -> Pose<World, Camera> {
            Pose::from_parts(UnitQuaternion::identity(), Vector3::z() * k as f64)
        };
        let trajectory =
            ExternalTrajectory { world_from_camera: (0..FRAMES).map(pose).collect(), metric: true };
        let external = External { trajectory: Some(trajectory), ..External::default() };
        let mut front_end = FrontEnd::new(&Settings { external, ..Settings::new(CAMERA, CAMERA_HEIGHT_M) });
        front_end.away = away;
        for k in 0..FRAMES {
            let detection = Detection {
                class: VehicleClass::Car,
                score: (k as f64).sin(),
                bbox: BoundingBox::new([0.0, 0.0, 1.0, k as f64]),
                convention: BoxConvention::VisibleExtent,
                external_id: None,
                pixel_size: 1.0,
                road_below: None,
            };
            let info = FrameInfo { number: k as u64, timestamp_ns: k as i64 * 100_000_000, problem: None };
            let detections = vec![detection; k % 3];
            front_end.process_without_image(info, Observations { detections, ..Observations::default() });
        }
        front_end
    }

    #[test]
    fn all_comes_back_whether_or_not_a_file_can_be_written() {
        let full = || PutAway {
            motion: Archive::unwritable(),
            detections: Archive::unwritable(),
            keypoints: Archive::unwritable(),
            ..PutAway::default()
        };
        let records = [PutAway::default(), full()].map(|away| {
            let front_end = driven(away);
            assert!(front_end.record.detections.kept().len() < 300 && front_end.away.motion.len() > 400);
            front_end.finish(&NoProgress)
        });
        let scores =
            |record: &FrontEndRecord| -> Vec<usize> { record.detections.iter().map(Vec::len).collect() };
        assert_eq!(scores(&records[0]), (0..FRAMES).map(|k| k % 3).collect::<Vec<_>>());
        assert_eq!(format!("{:?}", records[0].motion), format!("{:?}", records[1].motion));
        assert_eq!(format!("{:?}", records[0].detections), format!("{:?}", records[1].detections));
        assert_eq!((records[0].motion.frames.first_kept(), records[0].motion.frames.len()), (0, FRAMES));
        assert!(records[0].keypoints.kept().len() == FRAMES && records[0].warnings.is_empty());
    }

    #[test]
    fn frames_that_do_not_come_back_are_unplaced_and_said() {
        let mut front_end = driven(PutAway::default());
        let away = front_end.away.motion.len();
        front_end.away.motion.break_file();
        front_end.away.detections.break_file();
        let record = front_end.finish(&NoProgress);
        assert!(record.motion.frames.len() == FRAMES && record.detections.len() == FRAMES);
        let placed = record.motion.frames.iter().filter(|f| f.segment == 0).count();
        assert_eq!((placed, record.detections[1].len()), (FRAMES - away, 0));
        let times: Vec<i64> = record.motion.frames.iter().map(|f| f.timestamp_ns).collect();
        assert_eq!(times, record.timestamps_ns());
        assert!(record.warnings.len() == 1 && record.warnings[0].contains("did not read back"));
    }
}
