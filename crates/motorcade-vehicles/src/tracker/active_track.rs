//! A track that is being followed.

use motorcade_perception::BoundingBox;
use nalgebra::Point3;

use super::ROUNDING_S;
use super::localizer::{Localizer, WorldPosition};
use super::options::{AdvancedTrackerOptions, TrackerOptions};
use super::standing::Standing;
use crate::ground::GroundFrame;
use crate::motion::MotionFilter;
use crate::time::{correlation_factor, interval_s};
use crate::track::{ClassVotes, Track, TrackBox};

/// Smallest prediction interval \[s\].
const LEAST_STEP_S: f64 = 1e-3;
/// Slack of the number of boxes, whose intervals are rounded.
const COUNT_ROUNDING: f64 = 1e-6;

/// A track that is being followed.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct ActiveTrack {
    pub(super) track: Track,
    /// Position in the camera of the frame of its last box \[m\]. It is kept relative to that camera, because the estimate of the
    /// camera's pose may still change.
    in_camera: Point3<f64>,
    /// Position and velocity in the world at the last box.
    motion: MotionFilter,
    standing: Standing,
    /// Frame of the last box.
    last_frame: usize,
    /// Camera and road of that frame.
    last_ground: GroundFrame,
    /// Time of the last box that could start a track \[s\].
    confident_s: f64,
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
        options: &AdvancedTrackerOptions,
    ) -> Option<Self> {
        let (position, covariance) = localizer.position(ground, &first.observed)?;
        let motion = MotionFilter::new(&position, &covariance, &localizer.motion);
        let in_camera = ground.world_from_camera.inverse().transform_point(&Point3::from(position));
        let track = Track::new(id, first.observed.class, vec![first]);
        let mut votes = ClassVotes::default();
        votes.add(&first, options.least_vote);
        let (last_frame, last_ground, confident_s) = (first.frame, *ground, ground.time_s);
        let independent_boxes = 1.0;
        let standing = Standing::new(in_camera, covariance);
        Some(Self {
            track,
            in_camera,
            motion,
            standing,
            last_frame,
            last_ground,
            confident_s,
            independent_boxes,
            votes,
        })
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

    /// Time since the last box that could start a track \[s\].
    pub(super) fn unconfident_s(&self, now: &GroundFrame) -> f64 {
        now.time_s - self.confident_s
    }

    /// True while a next box may come: for the longest gap after a box that could start a track; after a weaker one until the vehicle would count as occluded.
    /// Weak boxes here and there do not keep a track alive.
    pub(super) fn is_awaited(&self, now: &GroundFrame, options: &TrackerOptions) -> bool {
        self.unconfident_s(now) <= options.longest_gap_s + ROUNDING_S
            || self.unseen_s(now) <= options.advanced.occluded_after_s + ROUNDING_S
    }

    /// Notes that a box which could start a track was assigned.
    pub(super) fn confirm_at(&mut self, now: &GroundFrame) {
        self.confident_s = now.time_s;
    }

    /// Predicted motion at the time of a frame.
    fn predict(&self, localizer: &Localizer, now: &GroundFrame) -> MotionFilter {
        let up = now.world_from_camera.transform_vector(&now.up);
        let mut motion = self.motion;
        motion.predict(self.unseen_s(now).max(LEAST_STEP_S), &up, &localizer.motion);
        motion
    }

    /// Predicted positions at the time of a frame, by motion and by standing, the more likely one first. Only that one where the
    /// boxes decide between the two.
    fn predicted_positions(
        &self,
        localizer: &Localizer,
        now: &GroundFrame,
        options: &AdvancedTrackerOptions,
    ) -> Vec<WorldPosition> {
        let standing = || self.standing.predict(&self.last_ground, now, options);
        let moving = || position_of(&self.predict(localizer, now));
        let evidence = self.standing.motion_evidence();
        if evidence.abs() < options.decisive_evidence {
            if evidence < 0.0 { vec![standing(), moving()] } else { vec![moving(), standing()] }
        } else if evidence < 0.0 {
            vec![standing()]
        } else {
            vec![moving()]
        }
    }

    /// True when its boxes decide that it stands.
    pub(super) fn stands(&self, options: &AdvancedTrackerOptions) -> bool {
        self.standing.motion_evidence() <= -options.decisive_evidence
    }

    /// Squared Mahalanobis distance of a position from the one predicted by motion or standing, unless the boxes decide between
    /// the two; `None` beyond the gate, and where the prediction is so uncertain that another vehicle would fit too.
    pub(super) fn distance(
        &self,
        localizer: &Localizer,
        ground: &GroundFrame,
        (position, covariance): &WorldPosition,
        options: &AdvancedTrackerOptions,
    ) -> Option<f64> {
        let distance = |(predicted, spread): WorldPosition| {
            let difference = position - predicted;
            let d2 = difference.dot(&((spread + covariance).try_inverse()? * difference));
            let largest_m = difference.norm().max(spread.trace().sqrt());
            (d2 < options.reidentify_chi2 && largest_m < options.reidentify_m).then_some(d2)
        };
        let predicted = self.predicted_positions(localizer, ground, options);
        predicted.into_iter().filter_map(distance).min_by(f64::total_cmp)
    }

    /// Predicted boxes, one a predicted position: the last one, moved and scaled as its position on the road moves in the image.
    pub(super) fn predicted_boxes(
        &self,
        localizer: &Localizer,
        ground: &GroundFrame,
        options: &AdvancedTrackerOptions,
    ) -> Vec<BoundingBox> {
        let Some(last) = self.track.boxes.last() else { return Vec::new() };
        let bbox = &last.observed.bbox;
        let one = |(position, _): WorldPosition| {
            let now = ground.world_from_camera.inverse().transform_point(&Point3::from(position));
            let (a, b) = (localizer.camera.project(&self.in_camera)?, localizer.camera.project(&now)?);
            let most = options.largest_scale_change;
            let scale = (self.in_camera.z / now.z).clamp(1.0 / most, most);
            let (x, y) = bbox.centre();
            // The position is the bottom centre: offsets of the box from its projection scale with the inverse distance.
            let (cx, cy) = (b.x + (x - a.x) * scale, b.y + (y - a.y) * scale);
            let (w, h) = (0.5 * bbox.width() * scale, 0.5 * bbox.height() * scale);
            Some(BoundingBox { x1: cx - w, y1: cy - h, x2: cx + w, y2: cy + h })
        };
        self.predicted_positions(localizer, ground, options).into_iter().filter_map(one).collect()
    }

    /// Appends a box and updates the motion with its position.
    pub(super) fn extend(
        &mut self,
        localizer: &Localizer,
        ground: &GroundFrame,
        next: TrackBox,
        options: &AdvancedTrackerOptions,
    ) {
        self.track.boxes.push(next);
        let mut motion = self.predict(localizer, ground);
        let elapsed_s = interval_s(self.last_ground.time_s, ground.time_s);
        self.independent_boxes += (elapsed_s / localizer.correlation_time_s).min(1.0);
        self.votes.add(&next, options.least_vote);
        let standing = self.standing.predict(&self.last_ground, ground, options);
        if let Some((position, covariance)) = localizer.position(ground, &next.observed) {
            let correlation = correlation_factor(localizer.correlation_time_s, elapsed_s);
            let measured = (position, covariance * correlation);
            self.standing.update(ground, &standing, &position_of(&motion), &measured, options);
            motion.update(&measured.0, &measured.1, &localizer.motion);
        } else {
            self.standing.keep(ground, &standing);
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

/// Position of a filter and its covariance.
fn position_of(motion: &MotionFilter) -> WorldPosition {
    (motion.x.fixed_rows::<3>(0).into_owned(), motion.p.fixed_view::<3, 3>(0, 0).into_owned())
}
