//! Tracking of a frame against the map.

use motorcade_geometry::robust::median;
use nalgebra::{Matrix2, Point2, Point3};

use super::scratch::Scratch;
use super::velocity::Velocity;
use super::{CameraFromWorld, Frame, LastFrame, Odometry};
use crate::map::{Landmark, Observation, PoseEstimate};
use crate::time::nanoseconds;
use crate::tracking::{PixelClass, Pyramid, Request, StaticMask, track_checked};
use crate::trajectory::FrameStatus;

impl Odometry {
    pub(super) fn track_frame(&mut self, frame: &Frame<'_>) {
        let mut scratch = std::mem::take(&mut self.scratch);
        self.track_with(&mut scratch, frame);
        self.scratch = scratch;
    }

    fn track_with(&mut self, scratch: &mut Scratch, frame: &Frame<'_>) {
        let Some(last) = self.last.take() else { return };
        let last_pose = last.camera_from_world;
        let since_last_ns = frame.timestamp_ns - last.timestamp_ns;
        let predicted = self.velocity.over(since_last_ns.max(0)) * last_pose;
        self.track_landmarks(&last, frame, &predicted, scratch);
        let mut standstill = self.test_standstill(frame.timestamp_ns, scratch);
        let mut located = self.locate(&predicted, &last_pose, scratch);
        // The pictures go on as before over a jump of the clock.
        let late_intervals = self.options.advanced.policy.late_intervals;
        let late = located.is_none() && self.velocity.is_outlasted_by(since_last_ns, late_intervals);
        if late {
            let next = self.velocity.once() * last_pose;
            self.track_landmarks(&last, frame, &next, scratch);
            standstill = self.test_standstill(frame.timestamp_ns, scratch);
            located = self.locate(&next, &last_pose, scratch);
        }
        let Some(estimate) = located else {
            self.last = Some(last);
            self.fail(frame);
            return;
        };
        let pose = if standstill.stands { last_pose } else { estimate.camera_from_world };
        let motion = pose * last_pose.inverse();
        let status = if standstill.stands { FrameStatus::Standstill } else { FrameStatus::Tracked };
        let interval_ns = self.since_last_record_ns(frame.timestamp_ns);

        self.note_shift(frame.number, &predicted, &estimate, &scratch.observations);
        self.failing_ns = 0;
        self.commit_pixels(&scratch.pixels, scratch.refiner.inliers(), interval_ns);
        let row_motion = self.row_motion();
        self.window.triangulate_tracked(&self.camera, &estimate.camera_from_world, &row_motion);
        if !late {
            self.velocity = Velocity::new(&motion.log(), since_last_ns, frame.number - last.frame);
        }
        self.record_tracked(frame.timestamp_ns, &estimate, pose, status);
        let keyframe = !standstill.stands && self.needs_keyframe(&mut scratch.values);
        if keyframe {
            self.add_keyframe(frame, pose);
        }
        let pose = if keyframe { self.newest_pose(pose) } else { pose };
        let age_ns = frame.timestamp_ns - last.template.timestamp_ns;
        let advanced = &self.options.klt.advanced;
        let renewed = LastFrame::at(frame, pose);
        let old = age_ns < 0 || age_ns >= nanoseconds(advanced.template_s);
        self.last = if keyframe || old || self.has_moved_far(&mut scratch.values) {
            self.renew_templates();
            Some(renewed)
        } else {
            Some(LastFrame { template: last.template, ..renewed })
        };
        self.commit_standstill(standstill, frame.timestamp_ns);
        if keyframe && self.depths_left(&mut scratch.values) {
            self.renew_map(frame.number);
        }
    }

    /// True when the landmarks are so near or far in the map's unit that it cannot be the one the map began with.
    fn depths_left(&self, depths: &mut Vec<f64>) -> bool {
        let Some(pose) = self.window.newest().map(|k| k.camera_from_world) else { return false };
        let seen = self.window.landmarks.iter().filter(|l| l.is_static() && l.pixel.is_some());
        depths.clear();
        depths.extend(seen.filter_map(|l| Some(pose.transform_point(&l.point_in_world?).z)));
        let (begun, most) =
            (self.options.advanced.policy.median_depth, self.options.advanced.feedback.most_depth_ratio.ln());
        median(depths).is_some_and(|depth| (depth.max(1e-9) / begun).ln().abs() > most)
    }

    /// Bridges a frame that could not be located; too many of them end the segment.
    fn fail(&mut self, frame: &Frame<'_>) {
        self.failing_ns += self.since_last_record_ns(frame.timestamp_ns).max(0);
        self.bridge(frame.timestamp_ns);
        if self.failing_ns >= nanoseconds(self.options.advanced.policy.give_up_s) {
            self.start_segment(frame);
        }
    }

    /// Puts the new pixel of every landmark into the scratch.
    fn track_landmarks(
        &self,
        last: &LastFrame,
        frame: &Frame<'_>,
        predicted: &CameraFromWorld,
        scratch: &mut Scratch,
    ) {
        let Scratch { pixels, depths, .. } = scratch;
        let template = &last.template;
        depths.refill(&self.window.landmarks, &template.camera_from_world);
        let track = |landmark: &Landmark| {
            landmark.pixel?;
            let from = landmark.template_pixel?;
            let request = self
                .request_with_position(landmark, from, &template.camera_from_world, predicted)
                .unwrap_or_else(|| {
                    let options = &self.options;
                    let depth = depths.around(&from, &options.advanced.window);
                    let depth = depth.unwrap_or(options.advanced.policy.far_depth);
                    self.request_at_depth(from, depth, &template.camera_from_world, predicted)
                });
            let to: &Pyramid = frame.pyramid;
            track_checked(&template.pyramid, to, &request, &self.options.klt)
                .filter(|p| stays_visible(landmark, frame.mask, p))
        };
        pixels.clear();
        pixels.extend(self.window.landmarks.iter().map(track));
    }

    /// Prediction of a landmark by its position; `None` without one, or when it is implausible.
    fn request_with_position(
        &self,
        landmark: &Landmark,
        from: Point2<f64>,
        template_pose: &CameraFromWorld,
        predicted: &CameraFromWorld,
    ) -> Option<Request> {
        let advanced = &self.options.klt.advanced;
        let point = landmark.point_in_world?;
        let (a, b) = (template_pose.transform_point(&point), predicted.transform_point(&point));
        // Only the motion is predicted: the landmark may project beside its tracked pixel.
        let motion = self.camera.project(&b)? - self.camera.project(&a)?;
        let plausible = motion.norm() < advanced.longest_motion * f64::from(self.camera.width);
        plausible.then(|| Request {
            from,
            expected: from + motion,
            from_offset: Matrix2::identity() * self.growth(b.z / a.z),
            top_level: advanced.landmark_level,
        })
    }

    /// Prediction of a corner without a position, at a depth.
    fn request_at_depth(
        &self,
        from: Point2<f64>,
        depth: f64,
        template_pose: &CameraFromWorld,
        predicted: &CameraFromWorld,
    ) -> Request {
        let motion = *predicted * template_pose.inverse();
        let point = Point3::from(self.camera.ray(&from) * depth);
        let moved = motion.transform_point(&point);
        Request {
            from,
            expected: self.camera.project(&moved).unwrap_or(from),
            from_offset: Matrix2::identity() * self.growth(moved.z / point.z),
            top_level: self.options.klt.advanced.corner_level,
        }
    }

    fn growth(&self, depth_ratio: f64) -> f64 {
        let [least, most] = self.options.klt.advanced.growth;
        depth_ratio.clamp(least, most)
    }

    /// True when the image has moved so far against the templates that patches of near points look different.
    fn has_moved_far(&self, motions: &mut Vec<f64>) -> bool {
        let landmarks = self.window.landmarks.iter().filter(|l| l.is_static());
        motions.clear();
        motions.extend(landmarks.filter_map(|l| Some((l.pixel? - l.template_pixel?).norm())));
        median(motions).is_none_or(|m| m > self.options.klt.advanced.template_motion_px)
    }

    /// Takes the templates of the next frames from the present one.
    pub(super) fn renew_templates(&mut self) {
        for landmark in &mut self.window.landmarks {
            landmark.template_pixel = landmark.pixel;
        }
    }

    /// Pose against the map.
    fn locate(
        &self,
        predicted: &CameraFromWorld,
        last_pose: &CameraFromWorld,
        scratch: &mut Scratch,
    ) -> Option<PoseEstimate> {
        let Scratch { pixels, observations, refiner, .. } = scratch;
        let row_motion = self.row_motion();
        let observation = |(l, p): (&Landmark, &Option<Point2<f64>>)| {
            l.is_static().then_some(())?;
            let point_in_world = l.point_in_world?;
            let pixel = row_motion.at_frame_time(&self.camera, predicted, &point_in_world, p.as_ref()?);
            Some(Observation { point_in_world, pixel })
        };
        observations.clear();
        observations.extend(self.window.landmarks.iter().zip(&*pixels).filter_map(observation));
        let policy = &self.options.advanced.policy;
        let least_share = policy.least_inlier_share * observations.len() as f64;
        let good =
            |e: &PoseEstimate| e.inlier_count >= policy.least_inliers && e.inlier_count as f64 >= least_share;
        let mut refine =
            |pose| refiner.refine(&self.camera, pose, observations, &self.options.advanced.pose).filter(good);
        // After a sudden turn or stop the pose before is the better start.
        refine(predicted).or_else(|| refine(last_pose))
    }

    /// Commits the tracked pixels. `inliers` has a flag for each landmark that took part in the pose.
    fn commit_pixels(&mut self, pixels: &[Option<Point2<f64>>], inliers: &[bool], interval_ns: i64) {
        let most_ns = nanoseconds(self.options.advanced.policy.outlier_s);
        let mut flags = inliers.iter();
        for (landmark, pixel) in self.window.landmarks.iter_mut().zip(pixels) {
            if landmark.is_static() && landmark.point_in_world.is_some() && pixel.is_some() {
                let inlier = flags.next().copied().unwrap_or(true);
                landmark.outlier_ns = if inlier { 0 } else { landmark.outlier_ns + interval_ns };
            }
            landmark.pixel = *pixel;
            if landmark.outlier_ns >= most_ns {
                landmark.pixel = None;
                landmark.point_in_world = None;
            }
        }
        self.window.landmarks.retain(|l| l.pixel.is_some() || l.point_in_world.is_some());
    }
}

/// False where a vehicle occludes a scene point. A point on a vehicle may leave a box that is drawn tight.
fn stays_visible(landmark: &Landmark, mask: &StaticMask<'_>, pixel: &Point2<f64>) -> bool {
    match mask.class(pixel) {
        PixelClass::Scene => true,
        PixelClass::Vehicle | PixelClass::BoxRim => landmark.is_on_vehicle(),
        PixelClass::Excluded => false,
    }
}

/// Outcome of the standstill test.
#[derive(Clone, Copy, Debug)]
pub(super) struct StandstillTest {
    pub stands: bool,
    /// True when the reference pixels are to be replaced: the camera moved, and they are old enough.
    renew: bool,
}

impl Odometry {
    /// Tests the median image motion of the landmarks since the last moving frame, over at least `standstill_s`, which at high
    /// frame rates is several frames. At standstill the reference stays, so that a creeping camera is recognised after a while
    /// however small its motion per frame.
    fn test_standstill(&self, timestamp_ns: i64, scratch: &mut Scratch) -> StandstillTest {
        let policy = &self.options.advanced.policy;
        let Scratch { pixels, values: motions, .. } = scratch;
        let tracked = self.window.landmarks.iter().zip(pixels).filter(|(l, _)| l.is_static());
        motions.clear();
        motions.extend(tracked.filter_map(|(l, p)| Some(((*p)? - l.standstill_pixel?).norm())));
        let enough = motions.len() >= policy.least_inliers;
        let still = enough && median(motions).is_some_and(|m| m < policy.standstill_px);
        let age_ns = timestamp_ns - self.standstill.reference_ns;
        let old_enough = age_ns >= nanoseconds(policy.standstill_s) || age_ns < 0;
        let stands = still && (old_enough || self.standstill.stands);
        StandstillTest { stands, renew: old_enough && !stands }
    }

    fn commit_standstill(&mut self, test: StandstillTest, timestamp_ns: i64) {
        self.standstill.stands = test.stands;
        if test.renew {
            self.renew_standstill_reference(timestamp_ns);
        }
    }

    /// Takes the present pixels as the reference of the next standstill test.
    pub(super) fn renew_standstill_reference(&mut self, timestamp_ns: i64) {
        self.standstill.reference_ns = timestamp_ns;
        for landmark in &mut self.window.landmarks {
            landmark.standstill_pixel = landmark.pixel;
        }
    }
}
