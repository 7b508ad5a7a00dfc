//! Advancing a map: landmarks are followed, the camera located, keyframes taken.

use std::sync::Arc;

use motorcade_geometry::robust::median;
use nalgebra::{Matrix2, Point2, Point3};

use super::{CameraFromCamera, CameraFromWorld, Odometry, Scratch};
use crate::map::Keyframe;
use crate::map::Landmark;
use crate::map::{Observation, PoseEstimate};
use crate::tracking::Pyramid;
use crate::tracking::detect;
use crate::tracking::{Place, StaticMask};
use crate::tracking::{Request, track_checked};
use crate::trajectory::FrameStatus;

impl Odometry {
    pub(super) fn advance(&mut self, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
        let mut scratch = std::mem::take(&mut self.scratch);
        self.advance_with(&mut scratch, pyramid, mask);
        self.scratch = scratch;
    }

    fn advance_with(&mut self, scratch: &mut Scratch, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
        let Some((last_frame, last_pyramid, last_pose)) = self.last.take() else { return };
        let frame = self.out.frames.len();
        let predicted = (last_frame..frame).fold(last_pose, |pose, _| self.velocity.cast() * pose);
        self.follow_landmarks([&last_pyramid, pyramid], [&last_pose, &predicted], mask, scratch);
        let still = self.is_standstill(scratch);
        let estimate = self.locate(&predicted, &last_pose, scratch);
        let Some(estimate) = estimate else {
            self.last = Some((last_frame, last_pyramid, last_pose));
            self.failures += 1;
            self.bridge();
            if self.failures >= self.options.policy.give_up_after {
                self.start_over(frame, pyramid, mask);
            }
            return;
        };
        self.failures = 0;
        self.commit_pixels(&scratch.pixels, scratch.refiner.inliers());
        self.window.triangulate_tracked(&self.camera, &estimate.camera_from_world);
        let pose = if still { last_pose } else { estimate.camera_from_world };
        let step: CameraFromCamera = (pose * last_pose.inverse()).cast();
        self.velocity = CameraFromCamera::exp(&(step.log() / (frame - last_frame) as f64));
        self.record(&estimate, pose, if still { FrameStatus::Standstill } else { FrameStatus::Tracked });
        self.last = Some((frame, pyramid.clone(), pose));
        if !still && self.wants_keyframe(&mut scratch.values) {
            self.add_keyframe(frame, pose, pyramid, mask);
            self.last = Some((frame, pyramid.clone(), self.newest_pose(pose)));
        }
    }

    /// Puts the new pixel of every landmark into the scratch.
    fn follow_landmarks(
        &self,
        [from, to]: [&Pyramid; 2],
        [last_pose, predicted]: [&CameraFromWorld; 2],
        mask: &StaticMask<'_>,
        scratch: &mut Scratch,
    ) {
        /// A depth without parallax, in the segment's unit.
        const FAR: f64 = 1e4;
        let motion: CameraFromCamera = (*predicted * last_pose.inverse()).cast();
        let Scratch { pixels, depths, .. } = scratch;
        depths.refill(&self.window.landmarks, last_pose);
        let one = |landmark: &Landmark| {
            let from_pixel = landmark.pixel?;
            let known = landmark.point_in_world.and_then(|p| {
                let (a, b) = (last_pose.transform_point(&p), predicted.transform_point(&p));
                let expected = self.camera.project(&b)?;
                // Where the map says it was may differ from where it was tracked: only the motion is predicted.
                let motion = expected - self.camera.project(&a)?;
                (motion.norm() < 0.25 * f64::from(self.camera.width))
                    .then_some((from_pixel + motion, (b.z / a.z).clamp(0.5, 2.0)))
            });
            let request = match known {
                Some((expected, ratio)) => Request {
                    from: from_pixel,
                    expected,
                    from_offset: Matrix2::identity() * ratio,
                    top_level: 2,
                },
                None => {
                    let depth = depths.around(&from_pixel).unwrap_or(FAR);
                    let seen = Point3::from(self.camera.ray(&from_pixel) * depth);
                    let moved = motion.transform_point(&seen);
                    let expected = self.camera.project(&moved).unwrap_or(from_pixel);
                    let ratio = (moved.z / seen.z).clamp(0.5, 2.0);
                    Request {
                        from: from_pixel,
                        expected,
                        from_offset: Matrix2::identity() * ratio,
                        top_level: 3,
                    }
                }
            };
            track_checked(from, to, &request, &self.options.klt).filter(|p| stays(landmark, mask.place(p)))
        };
        pixels.clear();
        pixels.extend(self.window.landmarks.iter().map(one));
    }

    fn is_standstill(&self, scratch: &mut Scratch) -> bool {
        let Scratch { pixels, values: moves, .. } = scratch;
        let seen = self.window.landmarks.iter().zip(pixels).filter(|(l, _)| l.is_static());
        moves.clear();
        moves.extend(seen.filter_map(|(l, p)| Some(((*p)? - l.pixel?).norm())));
        let enough = moves.len() >= self.options.policy.least_inliers;
        enough && median(moves).is_some_and(|m| m < self.options.policy.standstill_px)
    }

    fn locate(
        &self,
        predicted: &CameraFromWorld,
        last_pose: &CameraFromWorld,
        scratch: &mut Scratch,
    ) -> Option<PoseEstimate> {
        let Scratch { pixels, observations, refiner, .. } = scratch;
        let observation = |(l, p): (&Landmark, &Option<Point2<f64>>)| {
            l.is_static().then_some(())?;
            Some(Observation { point_in_world: l.point_in_world?, pixel: (*p)? })
        };
        observations.clear();
        observations.extend(self.window.landmarks.iter().zip(&*pixels).filter_map(observation));
        let good = |e: &PoseEstimate| {
            e.inlier_count >= self.options.policy.least_inliers
                && 10 * e.inlier_count >= 4 * observations.len()
        };
        let mut from =
            |pose| refiner.refine(&self.camera, pose, observations, &self.options.pose).filter(good);
        // A sudden turn or stop: begin from the pose before.
        from(predicted).or_else(|| from(last_pose))
    }

    /// `inliers` of the landmarks that took part in the pose.
    fn commit_pixels(&mut self, pixels: &[Option<Point2<f64>>], inliers: &[bool]) {
        const STRIKES: u8 = 3;
        let mut verdicts = inliers.iter();
        for (landmark, pixel) in self.window.landmarks.iter_mut().zip(pixels) {
            if landmark.is_static() && landmark.point_in_world.is_some() && pixel.is_some() {
                let inlier = verdicts.next().copied().unwrap_or(true);
                landmark.strikes = if inlier { 0 } else { landmark.strikes + 1 };
            }
            landmark.pixel = *pixel;
            if landmark.strikes >= STRIKES {
                landmark.pixel = None;
                landmark.point_in_world = None;
            }
        }
        self.window.landmarks.retain(|l| l.pixel.is_some() || l.point_in_world.is_some());
    }

    /// `flow` is scratch.
    fn wants_keyframe(&self, flow: &mut Vec<f64>) -> bool {
        let Some(newest) = self.window.newest() else { return false };
        let seen_then = self.window.landmarks.iter().filter(|l| l.is_static()).filter_map(|l| {
            l.sightings.last().filter(|(n, _)| *n == newest.number).map(|(_, then)| (l.pixel, then))
        });
        let mut total = 0;
        flow.clear();
        for (now, then) in seen_then {
            total += 1;
            flow.extend(now.map(|p| (p - then).norm()));
        }
        let kept = flow.len() as f64 / f64::from(total.max(1));
        kept < self.options.policy.keyframe_kept
            || median(flow).is_none_or(|m| m > self.options.policy.keyframe_flow_rad * self.camera.focal_px())
    }

    pub(super) fn add_keyframe(
        &mut self,
        frame: usize,
        pose: CameraFromWorld,
        pyramid: &Pyramid,
        mask: &StaticMask<'_>,
    ) {
        let segment = self.out.keyframes.len() - 1;
        let number = self.out.keyframes[segment].len();
        self.out.keyframes[segment].push(pose);
        self.window.push(Keyframe::new(number, pose));
        self.window.triangulate(&self.camera);
        self.window.adjust(&self.camera);
        for keyframe in self.window.keyframes() {
            self.out.keyframes[segment][keyframe.number] = keyframe.camera_from_world;
        }
        let record = &mut self.out.frames[frame];
        record.segment = segment;
        record.keyframe = number;
        record.camera_from_keyframe = CameraFromCamera::identity();
        record.status = FrameStatus::Tracked;
        let occupied: Vec<Point2<f64>> = self.window.landmarks.iter().filter_map(|l| l.pixel).collect();
        let allowed = |x: usize, y: usize| {
            matches!(mask.place(&Point2::new(x as f64, y as f64)), Place::Scene | Place::Vehicle)
        };
        let fresh = detect(pyramid.level(0), &occupied, allowed, &self.options.corners);
        self.window.landmarks.extend(fresh.into_iter().map(|p| {
            let on_vehicle = (mask.place(&p) == Place::Vehicle).then_some(0);
            Landmark { on_vehicle, ..Landmark::new(p, number) }
        }));
    }

    pub(super) fn newest_pose(&self, fallback: CameraFromWorld) -> CameraFromWorld {
        self.window.newest().map_or(fallback, |k| k.camera_from_world)
    }
}

/// A scene point that comes to lie in a vehicle's box is hidden by it; one on a vehicle may leave a box that is drawn tight.
fn stays(landmark: &Landmark, place: Place) -> bool {
    match place {
        Place::Scene => true,
        Place::Vehicle | Place::Rim => landmark.on_vehicle.is_some(),
        Place::Forbidden => false,
    }
}
