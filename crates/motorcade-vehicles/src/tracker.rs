//! Identities: which boxes of a drive belong to the same vehicle.
//!
//! Each track is followed on the road: its place, moved on at its velocity and seen from the new camera pose, tells where
//! and how large its next box will be. Confident boxes are matched first, weak ones may only prolong a track.

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, Detection, VehicleClass};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::ground::GroundFrame;
use crate::motion::MotionFilter;
use crate::single_view::{ObservedBox, locate};
use crate::size::size_prior;

/// Limits of the tracker.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerOptions {
    /// Score from which a box may begin a track.
    pub begin_score: f64,
    /// Score below which a box is not looked at.
    pub least_score: f64,
    /// Overlap (IoU) with the expected box that is a match.
    pub least_iou: f64,
    /// Longest gap bridged \[s\].
    pub longest_gap_s: f64,
    /// Boxes a track must have to be reported.
    pub least_boxes: usize,
}

impl Default for TrackerOptions {
    fn default() -> Self {
        Self { begin_score: 0.45, least_score: 0.15, least_iou: 0.25, longest_gap_s: 2.0, least_boxes: 4 }
    }
}

/// One box of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackBox {
    /// Frame (row of the run).
    pub frame: usize,
    /// The box and its trustworthy edges.
    pub seen: ObservedBox,
    /// Score.
    pub score: f64,
}

/// The boxes of one vehicle, in order of time.
#[derive(Clone, Debug)]
pub struct Track {
    /// Identity.
    pub id: usize,
    /// Class most of its boxes have.
    pub class: VehicleClass,
    /// Boxes.
    pub boxes: Vec<TrackBox>,
}

/// Times are nanoseconds made seconds: a gap of exactly the longest must count as one \[s\].
const ROUNDING_S: f64 = 1e-6;
/// χ² of four edges stays under it in 99 %.
const EXPLAINED: f64 = 13.3;
/// A vehicle not seen for longer was hidden, not missed \[s\].
const OUT_OF_SIGHT_S: f64 = 0.3;
/// Two boxes that overlap more are the same vehicle seen twice.
const DOUBLED_IOU: f64 = 0.5;

impl Track {
    /// Gives the track the class most of its boxes have, and its boxes that class.
    fn settle(&mut self) {
        self.class = majority(&self.boxes);
        for b in &mut self.boxes {
            b.seen.class = self.class;
        }
    }
}

struct ActiveTrack {
    track: Track,
    /// Place in the camera of the frame it was last seen in \[m\]: what is known of that frame's place in the world may
    /// change later.
    in_camera: Point3<f64>,
    /// Place and velocity in the world as of that frame.
    motion: MotionFilter,
    /// The frame it was last seen in, and what was known of it then.
    seen: (usize, GroundFrame),
}

/// Links the boxes of all frames. `detections[k]` are those of frame k.
pub fn track_vehicles(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    detections: &[Vec<Detection>],
    options: &TrackerOptions,
) -> Vec<Track> {
    let mut tracker = Tracker::new(*camera, *options);
    let mut tracks = Vec::new();
    for (frame, (ground, seen)) in grounds.iter().zip(detections).enumerate() {
        tracks.extend(tracker.advance(frame, ground, seen, |k| grounds.get(k).copied()));
    }
    tracks.extend(tracker.finish());
    tracks.sort_by_key(|t| t.id);
    tracks
}

/// Links boxes to tracks, frame by frame.
pub struct Tracker {
    camera: PinholeCamera,
    options: TrackerOptions,
    live: Vec<ActiveTrack>,
    next_id: usize,
}

impl Tracker {
    /// Knows no vehicle yet.
    pub fn new(camera: PinholeCamera, options: TrackerOptions) -> Self {
        Self { camera, options, live: Vec::new(), next_id: 1 }
    }

    /// Takes the boxes of the next frame; returns the tracks that have ended. `ground_of` tells what is known by now of
    /// frames that have been; of frames it has forgotten what was known in their time.
    pub fn advance(
        &mut self,
        frame: usize,
        ground: &GroundFrame,
        seen: &[Detection],
        ground_of: impl Fn(usize) -> Option<GroundFrame>,
    ) -> Vec<Track> {
        for live in &mut self.live {
            live.seen.1 = ground_of(live.seen.0).unwrap_or(live.seen.1);
            let place = live.seen.1.world_from_camera.transform_point(&live.in_camera);
            live.motion.x.fixed_rows_mut::<3>(0).copy_from(&place.coords);
        }
        let (camera, options) = (&self.camera, &self.options);
        let boxes: Vec<&Detection> = seen.iter().filter(|d| d.score >= options.least_score).collect();
        let all: Vec<BoundingBox> = boxes.iter().map(|d| d.bbox).collect();
        let expected: Vec<Option<BoundingBox>> =
            self.live.iter().map(|l| l.expected(camera, ground)).collect();
        let mut pairs = match_boxes(&self.live, &expected, &boxes, options);
        pairs.extend(self.found_again(ground, &boxes, &all, &pairs));
        let mut used = vec![false; boxes.len()];
        for (track, index) in pairs {
            used[index] = true;
            let seen = ObservedBox::new(boxes[index], camera, &all);
            self.live[track].extend(camera, ground, TrackBox { frame, seen, score: boxes[index].score });
        }
        for (index, detection) in boxes.iter().enumerate() {
            // A second box on a vehicle that is followed already (another class, a looser fit) is no new vehicle.
            let taken = all.iter().zip(&used).filter(|(_, used)| **used).map(|(b, _)| b);
            let doubled =
                expected.iter().flatten().chain(taken).any(|e| e.iou(&detection.bbox) > DOUBLED_IOU);
            if used[index] || detection.score < options.begin_score || doubled {
                continue;
            }
            let seen = ObservedBox::new(detection, camera, &all);
            let first = TrackBox { frame, seen, score: detection.score };
            if let Some(begun) = ActiveTrack::begin(self.next_id, camera, ground, first) {
                self.next_id += 1;
                self.live.push(begun);
            }
        }
        let (keep, gone): (Vec<ActiveTrack>, Vec<ActiveTrack>) = std::mem::take(&mut self.live)
            .into_iter()
            .partition(|l| ground.time_s - l.seen.1.time_s <= options.longest_gap_s + ROUNDING_S);
        self.live = keep;
        self.report(gone)
    }

    /// Tracks that were out of sight and boxes that nothing is expected at, where both stand at one place on the road: what comes out
    /// from behind another vehicle shows a part of itself, which overlaps little with the whole that is expected.
    fn found_again(
        &self,
        ground: &GroundFrame,
        boxes: &[&Detection],
        all: &[BoundingBox],
        pairs: &[(usize, usize)],
    ) -> Vec<(usize, usize)> {
        let gone = |t: &usize| {
            let live = &self.live[*t];
            let away_s = ground.time_s - live.seen.1.time_s;
            away_s > OUT_OF_SIGHT_S && pairs.iter().all(|(track, _)| track != t)
        };
        // Neither found itself nor a second box on one that was.
        let new = |b: &usize| {
            boxes[*b].score >= self.options.begin_score
                && pairs.iter().all(|(_, found)| all[*found].iou(&all[*b]) <= DOUBLED_IOU)
        };
        let gone: Vec<usize> = (0..self.live.len()).filter(gone).collect();
        let mut candidates = Vec::new();
        for b in (0..boxes.len()).filter(new).filter(|_| !gone.is_empty()) {
            let Some(stands) = place(&self.camera, ground, &ObservedBox::new(boxes[b], &self.camera, all))
            else {
                continue;
            };
            let near = |t: &usize| Some((self.live[*t].distance(ground, &stands)?, *t, b));
            candidates.extend(gone.iter().filter_map(near));
        }
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut found: Vec<(usize, usize)> = Vec::new();
        for (_, t, b) in candidates {
            if found.iter().all(|(track, other)| *track != t && *other != b) {
                found.push((t, b));
            }
        }
        found
    }

    /// The tracks followed at present whose boxes suffice, as far as they go; of each the boxes from frame `first` on.
    pub fn present(&self, first: usize) -> Vec<Track> {
        let enough = |l: &&ActiveTrack| l.track.boxes.len() >= self.options.least_boxes;
        let recent = |l: &ActiveTrack| {
            let mut track = l.track.clone();
            track.settle();
            track.boxes.retain(|b| b.frame >= first);
            track
        };
        self.live.iter().filter(enough).map(recent).filter(|t| !t.boxes.is_empty()).collect()
    }

    /// Ends all tracks.
    pub fn finish(mut self) -> Vec<Track> {
        let live = std::mem::take(&mut self.live);
        self.report(live)
    }

    fn report(&self, ended: Vec<ActiveTrack>) -> Vec<Track> {
        let mut tracks: Vec<Track> = ended.into_iter().map(|l| l.track).collect();
        tracks.retain(|t| t.boxes.len() >= self.options.least_boxes);
        tracks.iter_mut().for_each(Track::settle);
        tracks
    }
}

fn majority(boxes: &[TrackBox]) -> VehicleClass {
    let votes = |class: &VehicleClass| -> f64 {
        boxes.iter().filter(|b| b.seen.class == *class).map(|b| b.score.max(0.01)).sum()
    };
    VehicleClass::ALL.into_iter().max_by(|a, b| votes(a).total_cmp(&votes(b))).unwrap_or(VehicleClass::Car)
}

/// Best overlaps first, confident boxes before weak ones; one to one.
fn match_boxes(
    live: &[ActiveTrack],
    expected: &[Option<BoundingBox>],
    boxes: &[&Detection],
    options: &TrackerOptions,
) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let (mut track_used, mut box_used) = (vec![false; live.len()], vec![false; boxes.len()]);
    for confident in [true, false] {
        let mut candidates: Vec<(f64, usize, usize)> = Vec::new();
        for (t, predicted) in expected.iter().enumerate().filter(|(t, _)| !track_used[*t]) {
            let Some(predicted) = predicted else { continue };
            for (b, detection) in boxes.iter().enumerate().filter(|(b, _)| !box_used[*b]) {
                let iou = predicted.iou(&detection.bbox);
                if (detection.score >= options.begin_score) == confident && iou >= options.least_iou {
                    candidates.push((iou, t, b));
                }
            }
        }
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, t, b) in candidates {
            if !track_used[t] && !box_used[b] {
                (track_used[t], box_used[b]) = (true, true);
                pairs.push((t, b));
            }
        }
    }
    pairs
}

/// Where a box stands in the world, and its covariance (3×3).
fn place(
    camera: &PinholeCamera,
    ground: &GroundFrame,
    seen: &ObservedBox,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    // Box-level place: the heading of the road will do, or, where that does not explain the box, one across it.
    let prior = size_prior(seen.class);
    let facing = |heading_rad: f64| locate(camera, ground, seen, heading_rad, &prior);
    let along = facing(0.0);
    let found = match along {
        Some(view) if view.misfit(&prior) < EXPLAINED => view,
        _ => {
            let across = facing(std::f64::consts::FRAC_PI_2);
            along.into_iter().chain(across).min_by(|a, b| a.misfit(&prior).total_cmp(&b.misfit(&prior)))?
        }
    };
    let r = ground.world_from_camera.rotation_matrix();
    let position = ground.world_from_camera.transform_point(&found.position_in_camera);
    Some((position.coords, r * found.covariance * r.transpose()))
}

impl ActiveTrack {
    fn begin(id: usize, camera: &PinholeCamera, ground: &GroundFrame, first: TrackBox) -> Option<Self> {
        let (position, covariance) = place(camera, ground, &first.seen)?;
        let motion = MotionFilter::new(&position, &covariance);
        let in_camera = ground.world_from_camera.inverse().transform_point(&Point3::from(position));
        let seen = (first.frame, *ground);
        let track = Track { id, class: first.seen.class, boxes: vec![first] };
        Some(Self { track, in_camera, motion, seen })
    }

    fn last(&self) -> Option<&TrackBox> {
        self.track.boxes.last()
    }

    /// Its motion as expected at the time of a frame.
    fn moved(&self, now: &GroundFrame) -> MotionFilter {
        let up = now.world_from_camera.transform_vector(&now.up);
        let mut motion = self.motion;
        motion.predict((now.time_s - self.seen.1.time_s).max(1e-3), &up);
        motion
    }

    /// Squared distance \[χ²₃\] of a place in the world, with its covariance, from where the vehicle is expected; `None` beyond
    /// the 95 % quantile, and where the vehicle may be so far away that another one would fit.
    fn distance(&self, ground: &GroundFrame, place: &(Vector3<f64>, Matrix3<f64>)) -> Option<f64> {
        const FITS: f64 = 7.8;
        /// A car's length and a little: another one in the same lane is further off.
        const LOST_M: f64 = 5.0;
        let moved = self.moved(ground);
        let spread: Matrix3<f64> = moved.p.fixed_view::<3, 3>(0, 0).into_owned();
        let off = place.0 - moved.x.fixed_rows::<3>(0);
        let d2 = off.dot(&((spread + place.1).try_inverse()? * off));
        (d2 < FITS && off.norm().max(spread.trace().sqrt()) < LOST_M).then_some(d2)
    }

    /// Where the next box is expected: the last one, moved and scaled as its place on the road moves in the image.
    fn expected(&self, camera: &PinholeCamera, ground: &GroundFrame) -> Option<BoundingBox> {
        let last = self.last()?;
        let moved = Point3::from(self.moved(ground).x.fixed_rows::<3>(0).into_owned());
        let now = ground.world_from_camera.inverse().transform_point(&moved);
        let (a, b) = (camera.project(&self.in_camera)?, camera.project(&now)?);
        let scale = (self.in_camera.z / now.z).clamp(0.5, 2.0);
        let (x, y) = last.seen.bbox.centre();
        // The place is the bottom centre: offsets of the box from it scale with the distance.
        let (cx, cy) = (b.x + (x - a.x) * scale, b.y + (y - a.y) * scale);
        let (w, h) = (0.5 * last.seen.bbox.width() * scale, 0.5 * last.seen.bbox.height() * scale);
        Some(BoundingBox { x1: cx - w, y1: cy - h, x2: cx + w, y2: cy + h })
    }

    fn extend(&mut self, camera: &PinholeCamera, ground: &GroundFrame, next: TrackBox) {
        self.track.boxes.push(next);
        let mut motion = self.moved(ground);
        if let Some((position, covariance)) = place(camera, ground, &next.seen) {
            motion.update(&position, &covariance);
        }
        // 60 m/s: nothing on a road is faster.
        let speed = motion.x.fixed_rows::<3>(3).norm();
        if speed > 60.0 {
            motion.x.fixed_rows_mut::<3>(3).scale_mut(60.0 / speed);
        }
        let position = Point3::from(motion.x.fixed_rows::<3>(0).into_owned());
        self.in_camera = ground.world_from_camera.inverse().transform_point(&position);
        (self.motion, self.seen) = (motion, (next.frame, *ground));
    }
}
