//! A track that is being followed.

use motorcade_perception::BoundingBox;
use nalgebra::{Matrix3, Point3};

use super::localizer::{Localizer, WorldPosition};
use super::options::AdvancedTrackerOptions;
use crate::ground::GroundFrame;
use crate::motion::MotionFilter;
use crate::time::{correlation_factor, interval_s};
use crate::track::{ClassVotes, Track, TrackBox};

/// Smallest prediction interval \[s\].
const LEAST_STEP_S: f64 = 1e-3;
/// Slack of the number of boxes, whose intervals are rounded.
const COUNT_ROUNDING: f64 = 1e-6;

/// A track that is being followed.
pub(super) struct ActiveTrack {
    pub(super) track: Track,
    /// Position in the camera of the frame of its last box \[m\]. It is kept relative to that camera, because the estimate of the
    /// camera's pose may still change.
    in_camera: Point3<f64>,
    /// Position and velocity in the world at the last box.
    motion: MotionFilter,
    /// Frame of the last box.
    last_frame: usize,
    /// Camera and road of that frame.
    last_ground: GroundFrame,
    /// Boxes, counted as at most one per correlation time.
    independent_boxes: f64,
    votes: ClassVotes,
}

impl ActiveTrack {
    /// A new track from its first box; `None` when the box cannot be positioned.
    pub(super) fn begin(
        id: usize,
        localizer: &Localizer,
        ground: &GroundFrame,
        first: TrackBox,
    ) -> Option<Self> {
        let (position, covariance) = localizer.position(ground, &first.observed)?;
        let motion = MotionFilter::new(&position, &covariance, &localizer.motion);
        let in_camera = ground.world_from_camera.inverse().transform_point(&Point3::from(position));
        let track = Track::new(id, first.observed.class, vec![first]);
        let mut votes = ClassVotes::default();
        votes.add(&first);
        let (last_frame, last_ground, independent_boxes) = (first.frame, *ground, 1.0);
        Some(Self { track, in_camera, motion, last_frame, last_ground, independent_boxes, votes })
    }

    /// True when the track has enough boxes, counted as at most one per correlation time.
    pub(super) fn is_confirmed(&self, least_boxes: usize) -> bool {
        self.independent_boxes + COUNT_ROUNDING >= least_boxes as f64
    }

    /// The track with its boxes from frame `first` on and the class of all its boxes.
    pub(super) fn recent(&self, first: usize) -> Track {
        let from = self.track.boxes.partition_point(|b| b.frame < first);
        let boxes = self.track.boxes.get(from..).unwrap_or_default().to_vec();
        let mut track = Track::new(self.track.id, self.track.class, boxes);
        track.votes = self.votes;
        track.set_class(self.votes.class());
        track
    }

    /// Updates camera and road of the last box to their present estimates.
    pub(super) fn update_ground(&mut self, ground_of: impl Fn(usize) -> Option<GroundFrame>) {
        self.last_ground = ground_of(self.last_frame).unwrap_or(self.last_ground);
        let position = self.last_ground.world_from_camera.transform_point(&self.in_camera);
        self.motion.x.fixed_rows_mut::<3>(0).copy_from(&position.coords);
    }

    /// Time since the last box \[s\].
    pub(super) fn unseen_s(&self, now: &GroundFrame) -> f64 {
        now.time_s - self.last_ground.time_s
    }

    /// Predicted motion at the time of a frame.
    fn predict(&self, localizer: &Localizer, now: &GroundFrame) -> MotionFilter {
        let up = now.world_from_camera.transform_vector(&now.up);
        let mut motion = self.motion;
        motion.predict(self.unseen_s(now).max(LEAST_STEP_S), &up, &localizer.motion);
        motion
    }

    /// Squared Mahalanobis distance of a position from the predicted one; `None` beyond the gate, and where the prediction is
    /// so uncertain that another vehicle would fit too.
    pub(super) fn distance(
        &self,
        localizer: &Localizer,
        ground: &GroundFrame,
        (position, covariance): &WorldPosition,
        options: &AdvancedTrackerOptions,
    ) -> Option<f64> {
        let predicted = self.predict(localizer, ground);
        let spread: Matrix3<f64> = predicted.p.fixed_view::<3, 3>(0, 0).into_owned();
        let difference = position - predicted.x.fixed_rows::<3>(0);
        let d2 = difference.dot(&((spread + covariance).try_inverse()? * difference));
        let largest_m = difference.norm().max(spread.trace().sqrt());
        (d2 < options.reidentify_chi2 && largest_m < options.reidentify_m).then_some(d2)
    }

    /// Predicted box: the last one, moved and scaled as its position on the road moves in the image.
    pub(super) fn predicted_box(
        &self,
        localizer: &Localizer,
        ground: &GroundFrame,
        options: &AdvancedTrackerOptions,
    ) -> Option<BoundingBox> {
        let last = self.track.boxes.last()?;
        let position = Point3::from(self.predict(localizer, ground).x.fixed_rows::<3>(0).into_owned());
        let now = ground.world_from_camera.inverse().transform_point(&position);
        let (a, b) = (localizer.camera.project(&self.in_camera)?, localizer.camera.project(&now)?);
        let most = options.largest_scale_change;
        let scale = (self.in_camera.z / now.z).clamp(1.0 / most, most);
        let (x, y) = last.observed.bbox.centre();
        // The position is the bottom centre: offsets of the box from its projection scale with the inverse distance.
        let (cx, cy) = (b.x + (x - a.x) * scale, b.y + (y - a.y) * scale);
        let bbox = &last.observed.bbox;
        let (w, h) = (0.5 * bbox.width() * scale, 0.5 * bbox.height() * scale);
        Some(BoundingBox { x1: cx - w, y1: cy - h, x2: cx + w, y2: cy + h })
    }

    /// Appends a box and updates the motion with its position.
    pub(super) fn extend(&mut self, localizer: &Localizer, ground: &GroundFrame, next: TrackBox) {
        self.track.boxes.push(next);
        let mut motion = self.predict(localizer, ground);
        let elapsed_s = interval_s(self.last_ground.time_s, ground.time_s);
        self.independent_boxes += (elapsed_s / localizer.correlation_time_s).min(1.0);
        self.votes.add(&next);
        if let Some((position, covariance)) = localizer.position(ground, &next.observed) {
            let correlation = correlation_factor(localizer.correlation_time_s, elapsed_s);
            motion.update(&position, &(covariance * correlation), &localizer.motion);
        }
        let speed = motion.x.fixed_rows::<3>(3).norm();
        let largest = localizer.motion.largest_speed_mps;
        if speed > largest {
            motion.x.fixed_rows_mut::<3>(3).scale_mut(largest / speed);
        }
        let position = Point3::from(motion.x.fixed_rows::<3>(0).into_owned());
        self.in_camera = ground.world_from_camera.inverse().transform_point(&position);
        (self.motion, self.last_frame, self.last_ground) = (motion, next.frame, *ground);
    }
}
