//! Data association: boxes of a drive to vehicles.
//!
//! Each track is filtered on the road, under the hypotheses that it moves and that it stands; its predicted position, seen from the new camera pose, predicts its next box. Boxes are
//! assigned by overlap, confident ones first; occluded tracks are re-identified by position.

mod active_track;
mod association;
mod both_ways;
mod localizer;
mod options;
mod standing;
mod state;

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, Detection};

use crate::ground::GroundFrame;
use crate::observed_box::{ObservedBox, overlap};
use crate::options::VehicleOptions;
use crate::track::{Track, TrackBox};
use active_track::ActiveTrack;
use association::{Candidate, by_overlap, greedy};
use localizer::Localizer;

pub use both_ways::track_both_ways;
pub use options::{AdvancedTrackerOptions, TrackerOptions};
pub use state::TrackerState;

/// Slack for times rounded to nanoseconds: a gap of exactly the longest is bridged \[s\].
const ROUNDING_S: f64 = 1e-6;

/// Links the boxes of all frames, or of those until it is asked to stop; `detections[k]` are those of frame k.
pub fn track_vehicles(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    detections: &[Vec<Detection>],
    options: &TrackerOptions,
    vehicles: &VehicleOptions,
    stop: &dyn Fn() -> bool,
) -> Vec<Track> {
    let frames = 0..grounds.len().min(detections.len());
    linked(Tracker::of_drive(camera, options, vehicles), frames, grounds, detections, stop)
}

/// Links the boxes of frames in this order.
fn linked(
    mut tracker: Tracker,
    frames: impl Iterator<Item = usize>,
    grounds: &[GroundFrame],
    detections: &[Vec<Detection>],
    stop: &dyn Fn() -> bool,
) -> Vec<Track> {
    let mut tracks = Vec::new();
    for frame in frames.take_while(|_| !stop()) {
        let (ground, found) = (&grounds[frame], &detections[frame]);
        tracks.extend(tracker.advance(frame, ground, found, |k| grounds.get(k).copied()));
    }
    tracks.extend(tracker.finish());
    tracks.sort_by_key(|t| t.id);
    tracks
}

/// Links boxes to tracks, frame by frame.
pub struct Tracker {
    localizer: Localizer,
    options: TrackerOptions,
    /// That of the options where a whole drive is linked. Online the vehicle whose boxes a standing one does not get begins anew, without its history: 0
    /// there.
    least_standing_overlap: f64,
    active: Vec<ActiveTrack>,
    next_id: usize,
}

impl Tracker {
    /// A tracker without tracks. Of `vehicles` it uses the box fit and the motion model.
    pub fn new(camera: PinholeCamera, options: TrackerOptions, vehicles: &VehicleOptions) -> Self {
        let localizer = Localizer {
            camera,
            box_fit: vehicles.advanced.box_fit,
            motion: vehicles.advanced.motion,
            correlation_time_s: vehicles.advanced.correlation_time_s,
            explained_chi2: options.advanced.explained_chi2,
            hiding_score_ratio: options.advanced.hiding_score_ratio,
        };
        Self { localizer, options, least_standing_overlap: 0.0, active: Vec::new(), next_id: 1 }
    }

    /// A tracker for whole drives.
    fn of_drive(camera: &PinholeCamera, options: &TrackerOptions, vehicles: &VehicleOptions) -> Self {
        let least_standing_overlap = options.advanced.least_standing_overlap;
        Self { least_standing_overlap, ..Self::new(*camera, *options, vehicles) }
    }

    /// Takes the boxes of the next frame; returns the tracks that ended. `ground_of` gives the present estimate of an earlier
    /// frame; frames for which it returns `None` keep the ground frame stored when their box was detected.
    pub fn advance(
        &mut self,
        frame: usize,
        ground: &GroundFrame,
        detections: &[Detection],
        ground_of: impl Fn(usize) -> Option<GroundFrame>,
    ) -> Vec<Track> {
        // Its filter takes the errors of frames as independent. Those of a road that the way ahead tells are common to all: gates would be too narrow.
        let ground = &ground.without_road_ahead();
        let ground_of = |frame: usize| ground_of(frame).map(GroundFrame::without_road_ahead);
        self.active.iter_mut().for_each(|track| track.update_ground(ground_of));
        let (localizer, options) = (&self.localizer, &self.options);
        let boxes: Vec<&Detection> = detections.iter().filter(|d| d.score >= options.least_score).collect();
        let predict = |t: &ActiveTrack| t.predicted_boxes(localizer, ground, &options.advanced);
        let predicted: Vec<Vec<BoundingBox>> = self.active.iter().map(predict).collect();
        let level = |t: &ActiveTrack| {
            (t.unconfident_s(ground) / options.advanced.occluded_after_s.max(ROUNDING_S)) as usize
        };
        let levels: Vec<usize> = self.active.iter().map(level).collect();
        let observed: Vec<ObservedBox> = boxes.iter().map(|b| localizer.observe(b, &boxes)).collect();
        let fits = |track: usize, detection: usize| {
            let is_near = |p: &BoundingBox| overlap(p, &observed[detection]) >= self.least_standing_overlap;
            !self.active[track].stands(&options.advanced) || predicted[track].iter().any(is_near)
        };
        let mut pairs = by_overlap(&predicted, &levels, &boxes, &fits, options);
        pairs.extend(self.reidentify(ground, &boxes, &observed, &pairs));
        let mut assigned = vec![false; boxes.len()];
        for (track, index) in pairs {
            assigned[index] = true;
            let next = TrackBox { frame, observed: observed[index], score: boxes[index].score };
            self.active[track].extend(localizer, ground, next, &options.advanced);
            if boxes[index].score >= options.begin_score {
                self.active[track].confirm_at(ground);
            }
        }
        for (index, detection) in boxes.iter().enumerate() {
            // A second box on a tracked vehicle (another class, a looser fit) does not start a track.
            let taken = boxes.iter().zip(&assigned).filter(|(_, assigned)| **assigned).map(|(b, _)| &b.bbox);
            let mut known = predicted.iter().filter_map(|boxes| boxes.first()).chain(taken);
            let duplicate = known.any(|b| b.iou(&detection.bbox) > options.advanced.duplicate_iou);
            // Nor does one that a file holds several times.
            let repeated = || boxes.iter().take(index).any(|b| b == detection);
            if assigned[index] || detection.score < options.begin_score || duplicate || repeated() {
                continue;
            }
            let first = TrackBox { frame, observed: observed[index], score: detection.score };
            if let Some(begun) = ActiveTrack::begin(self.next_id, localizer, ground, first, &options.advanced)
            {
                self.next_id += 1;
                self.active.push(begun);
            }
        }
        let (active, ended): (Vec<ActiveTrack>, Vec<ActiveTrack>) =
            std::mem::take(&mut self.active).into_iter().partition(|t| t.is_awaited(ground, options));
        self.active = active;
        self.reported(ended)
    }

    /// Pairs of occluded tracks and unassigned boxes at the same position on the road. A vehicle that comes out from behind
    /// another shows a part of itself, which overlaps little with its predicted box.
    fn reidentify(
        &self,
        ground: &GroundFrame,
        boxes: &[&Detection],
        observed: &[ObservedBox],
        pairs: &[(usize, usize)],
    ) -> Vec<(usize, usize)> {
        let gates = &self.options.advanced;
        let occluded = |t: &usize| {
            self.active[*t].unseen_s(ground) > gates.occluded_after_s
                && pairs.iter().all(|(track, _)| track != t)
        };
        // Neither assigned nor a duplicate of an assigned box.
        let new = |b: &usize| {
            let duplicate =
                |(_, found): &(usize, usize)| boxes[*found].bbox.iou(&boxes[*b].bbox) > gates.duplicate_iou;
            boxes[*b].score >= self.options.begin_score && !pairs.iter().any(duplicate)
        };
        let occluded: Vec<usize> = (0..self.active.len()).filter(occluded).collect();
        if occluded.is_empty() {
            return Vec::new();
        }
        let mut candidates = Vec::new();
        for detection in (0..boxes.len()).filter(new) {
            let Some(position) = self.localizer.position(ground, &observed[detection]) else { continue };
            let candidate = |track: &usize| {
                let cost = self.active[*track].distance(&self.localizer, ground, &position, gates)?;
                Some(Candidate { cost, track: *track, detection })
            };
            candidates.extend(occluded.iter().filter_map(candidate));
        }
        greedy(candidates)
    }

    /// Confirmed active tracks; of each the boxes from frame `first` on.
    pub fn present(&self, first: usize) -> Vec<Track> {
        let confirmed = self.active.iter().filter(|t| t.is_confirmed(self.options.least_boxes));
        confirmed.map(|t| t.recent(first)).filter(|t| !t.boxes.is_empty()).collect()
    }

    /// Ends all tracks.
    pub fn finish(mut self) -> Vec<Track> {
        let active = std::mem::take(&mut self.active);
        self.reported(active)
    }

    fn reported(&self, ended: Vec<ActiveTrack>) -> Vec<Track> {
        let confirmed = ended.iter().filter(|t| t.is_confirmed(self.options.least_boxes));
        confirmed.map(|t| t.recent(0)).collect()
    }
}
