//! Identities: which boxes of a drive belong to the same vehicle.
//!
//! Each track is followed on the road: its place, moved on at its velocity and seen from the new camera pose, tells where
//! and how large its next box will be. Confident boxes are matched first, weak ones may only prolong a track.

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, Detection, VehicleClass};
use nalgebra::{Point3, Vector3};

use crate::ground::GroundFrame;
use crate::single_view::{SeenBox, locate};
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
    pub seen: SeenBox,
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

/// Two boxes that overlap more are the same vehicle seen twice.
const DOUBLED_IOU: f64 = 0.5;

struct Live {
    track: Track,
    /// Place in the world \[m\], with the camera depth it was measured at.
    position: Point3<f64>,
    velocity: Vector3<f64>,
    time_s: f64,
    place_frame: usize,
}

/// Links the boxes of all frames. `detections[k]` are those of frame k.
pub fn track_vehicles(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    detections: &[Vec<Detection>],
    options: &TrackerOptions,
) -> Vec<Track> {
    let (mut live, mut ended): (Vec<Live>, Vec<Track>) = (Vec::new(), Vec::new());
    let mut next_id = 1;
    for (frame, (ground, seen)) in grounds.iter().zip(detections).enumerate() {
        let boxes: Vec<&Detection> = seen.iter().filter(|d| d.score >= options.least_score).collect();
        let all: Vec<BoundingBox> = boxes.iter().map(|d| d.bbox).collect();
        let expected: Vec<Option<BoundingBox>> =
            live.iter().map(|l| l.expected(camera, ground, grounds)).collect();
        let pairs = match_boxes(&live, &expected, &boxes, options);
        let mut used = vec![false; boxes.len()];
        for (track, index) in pairs {
            used[index] = true;
            let seen = SeenBox::new(boxes[index].bbox, boxes[index].class, camera, &all);
            live[track].extend(camera, ground, TrackBox { frame, seen, score: boxes[index].score });
        }
        for (index, detection) in boxes.iter().enumerate() {
            // A second box on a vehicle that is followed already (another class, a looser fit) is no new vehicle.
            let taken = all.iter().zip(&used).filter(|(_, used)| **used).map(|(b, _)| b);
            let doubled =
                expected.iter().flatten().chain(taken).any(|e| e.iou(&detection.bbox) > DOUBLED_IOU);
            if used[index] || detection.score < options.begin_score || doubled {
                continue;
            }
            let seen = SeenBox::new(detection.bbox, detection.class, camera, &all);
            if let Some(begun) =
                Live::begin(next_id, camera, ground, TrackBox { frame, seen, score: detection.score })
            {
                next_id += 1;
                live.push(begun);
            }
        }
        let (keep, gone): (Vec<Live>, Vec<Live>) =
            live.into_iter().partition(|l| ground.time_s - l.time_s <= options.longest_gap_s);
        ended.extend(gone.into_iter().map(|l| l.track));
        live = keep;
    }
    ended.extend(live.into_iter().map(|l| l.track));
    ended.retain(|t| t.boxes.len() >= options.least_boxes);
    ended.sort_by_key(|t| t.id);
    for track in &mut ended {
        track.class = majority(&track.boxes);
        for b in &mut track.boxes {
            b.seen.class = track.class;
        }
    }
    ended
}

fn majority(boxes: &[TrackBox]) -> VehicleClass {
    let votes = |class: &VehicleClass| -> f64 {
        boxes.iter().filter(|b| b.seen.class == *class).map(|b| b.score.max(0.01)).sum()
    };
    VehicleClass::ALL.into_iter().max_by(|a, b| votes(a).total_cmp(&votes(b))).unwrap_or(VehicleClass::Car)
}

/// Best overlaps first, confident boxes before weak ones; one to one.
fn match_boxes(
    live: &[Live],
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

fn place(camera: &PinholeCamera, ground: &GroundFrame, seen: &SeenBox) -> Option<Point3<f64>> {
    // Box-level place: the heading of the road will do.
    let found = locate(camera, ground, seen, 0.0, &size_prior(seen.class))?;
    Some(ground.world_from_camera.transform_point(&found.position_in_camera))
}

impl Live {
    fn begin(id: usize, camera: &PinholeCamera, ground: &GroundFrame, first: TrackBox) -> Option<Self> {
        let position = place(camera, ground, &first.seen)?;
        let track = Track { id, class: first.seen.class, boxes: vec![first] };
        Some(Self {
            track,
            position,
            velocity: Vector3::zeros(),
            time_s: ground.time_s,
            place_frame: first.frame,
        })
    }

    fn last(&self) -> Option<&TrackBox> {
        self.track.boxes.last()
    }

    /// Where the next box is expected: the last one, moved and scaled as its place on the road moves in the image.
    fn expected(
        &self,
        camera: &PinholeCamera,
        ground: &GroundFrame,
        grounds: &[GroundFrame],
    ) -> Option<BoundingBox> {
        let last = self.last()?;
        let then = grounds.get(self.place_frame)?;
        let before = then.world_from_camera.inverse().transform_point(&self.position);
        let moved = self.position + self.velocity * (ground.time_s - self.time_s);
        let now = ground.world_from_camera.inverse().transform_point(&moved);
        let (a, b) = (camera.project(&before)?, camera.project(&now)?);
        let scale = (before.z / now.z).clamp(0.5, 2.0);
        let (x, y) = last.seen.bbox.centre();
        // The place is the bottom centre: offsets of the box from it scale with the distance.
        let (cx, cy) = (b.x + (x - a.x) * scale, b.y + (y - a.y) * scale);
        let (w, h) = (0.5 * last.seen.bbox.width() * scale, 0.5 * last.seen.bbox.height() * scale);
        Some(BoundingBox { x1: cx - w, y1: cy - h, x2: cx + w, y2: cy + h })
    }

    fn extend(&mut self, camera: &PinholeCamera, ground: &GroundFrame, next: TrackBox) {
        let dt = (ground.time_s - self.time_s).max(1e-3);
        self.track.boxes.push(next);
        let moved = self.position + self.velocity * dt;
        if let Some(measured) = place(camera, ground, &next.seen) {
            // Alpha–beta filter: gains of a vehicle seen ten times a second with a few per cent of depth noise.
            const ALPHA: f64 = 0.5;
            const BETA: f64 = 0.15;
            let innovation = measured - moved;
            self.position = moved + innovation * ALPHA;
            self.velocity += innovation * (BETA / dt);
            // 60 m/s: nothing on a road is faster, and one wrong box must not throw the track away.
            let speed = self.velocity.norm();
            if speed > 60.0 {
                self.velocity *= 60.0 / speed;
            }
        } else {
            self.position = moved;
        }
        (self.time_s, self.place_frame) = (ground.time_s, next.frame);
    }
}
