//! Beginning a map: corners followed from a first frame until two views tell depth.

use std::sync::Arc;

use motorcade_geometry::{
    Camera, Pose, RelativePoseOptions, World, relative_pose, robust::median, triangulate_midpoint,
};
use nalgebra::{Matrix2, Matrix6, Point2, Vector6};

use super::{CameraFromCamera, CameraFromWorld, Odometry};
use crate::map::Landmark;
use crate::map::{Keyframe, Window};
use crate::map::{Observation, PoseRefiner};
use crate::tracking::Pyramid;
use crate::tracking::StaticMask;
use crate::tracking::detect;
use crate::tracking::{Request, track_checked};
use crate::trajectory::{FrameStatus, fill};

/// Corners followed from the frame where the map may begin.
pub(super) struct Beginning {
    first_frame: usize,
    first_pixels: Vec<Point2<f64>>,
    /// Pixels per frame since, `None` where lost.
    tracks: Vec<Vec<Option<Point2<f64>>>>,
}

impl Odometry {
    pub(super) fn begin(&mut self, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
        let frame = self.out.frames.len();
        self.record_initialising();
        let Some(mut beginning) = self.beginning.take() else {
            self.restart_beginning(frame, pyramid, mask);
            return;
        };
        let Some((_, previous, _)) = self.last.take() else { return };
        let pixels = self.follow_freely(&previous, pyramid, &beginning, mask);
        beginning.tracks.push(pixels);
        let alive = beginning.tracks.last().map_or(0, |t| t.iter().flatten().count());
        // A small or plain image has few corners: half of those it had are enough, if they are not too few for two views.
        const LEAST_TRACKS: usize = 20;
        let enough = (beginning.first_pixels.len() / 2)
            .clamp(LEAST_TRACKS, self.options.policy.begin_tracks.max(LEAST_TRACKS));
        if alive < enough {
            self.restart_beginning(frame, pyramid, mask);
            return;
        }
        let flow = median_flow(&beginning.first_pixels, beginning.tracks.last());
        // Never below a few pixels, where the noise of tracking would pass for parallax.
        const LEAST_FLOW_PX: f64 = 4.0;
        let ready = flow >= (self.options.policy.begin_flow_rad * self.camera.focal_px()).max(LEAST_FLOW_PX);
        self.last = Some((frame, pyramid.clone(), CameraFromWorld::identity()));
        if flow < self.options.policy.standstill_px {
            self.out.frames[frame].status = FrameStatus::Standstill;
            // Still standing: keep only the first and the present frame, the ones between say the same.
            beginning.tracks.truncate(beginning.tracks.len().saturating_sub(1).max(1));
        }
        if ready && self.try_to_begin(frame, &beginning, pyramid, mask) {
            return;
        }
        self.beginning = Some(beginning);
    }

    pub(super) fn restart_beginning(&mut self, frame: usize, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
        let allowed = |x: usize, y: usize| mask.allows(&Point2::new(x as f64, y as f64));
        let first_pixels = detect(pyramid.level(0), &[], allowed, &self.options.corners);
        self.beginning = Some(Beginning { first_frame: frame, first_pixels, tracks: Vec::new() });
        self.last = Some((frame, pyramid.clone(), CameraFromWorld::identity()));
    }

    fn follow_freely(
        &self,
        previous: &Pyramid,
        pyramid: &Pyramid,
        beginning: &Beginning,
        mask: &StaticMask<'_>,
    ) -> Vec<Option<Point2<f64>>> {
        let before = beginning.tracks.last();
        let one = |i: usize| {
            let from = match before {
                Some(tracks) => tracks[i]?,
                None => beginning.first_pixels[i],
            };
            // The motion of the frame before, if any, is the best guess.
            let guess = match beginning.tracks.len() {
                0 => from,
                1 => from + (from - beginning.first_pixels[i]),
                n => beginning.tracks[n - 2][i].map_or(from, |p| from + (from - p)),
            };
            let request = Request { from, expected: guess, from_offset: Matrix2::identity(), top_level: 3 };
            track_checked(previous, pyramid, &request, &self.options.klt).filter(|p| mask.allows(p))
        };
        (0..beginning.first_pixels.len()).map(one).collect()
    }

    /// Two-view geometry between the first and the present frame; on success the map exists and earlier frames get poses.
    fn try_to_begin(
        &mut self,
        frame: usize,
        beginning: &Beginning,
        pyramid: &Arc<Pyramid>,
        mask: &StaticMask<'_>,
    ) -> bool {
        let Some(now) = beginning.tracks.last() else { return false };
        let pairs: Vec<(usize, Point2<f64>, Point2<f64>)> =
            (0..now.len()).filter_map(|i| Some((i, beginning.first_pixels[i], now[i]?))).collect();
        let rays: Vec<_> = pairs.iter().map(|(_, a, b)| (self.camera.ray(a), self.camera.ray(b))).collect();
        let options = RelativePoseOptions {
            seed: self.options.seed,
            ..RelativePoseOptions::for_pixel_noise(1.0, self.camera.focal_px())
        };
        let Some(found) = relative_pose::<Camera, World>(&rays, &options) else { return false };
        if 2 * found.inlier_count < pairs.len() {
            return false;
        }
        let last_pose = found.b_from_a;
        let cosine_limit = self.options.window.least_parallax_rad.cos();
        let mut landmarks = Vec::new();
        for ((i, a, b), (ray, inlier)) in pairs.iter().zip(rays.iter().zip(&found.inliers)) {
            let mut landmark = Landmark::new(*a, 0);
            landmark.pixel = Some(*b);
            let triangulated = inlier.then(|| triangulate_midpoint(&ray.0, &ray.1, &last_pose)).flatten();
            landmark.point_in_world = triangulated.filter(|(_, c)| *c < cosine_limit).map(|(p, _)| p);
            landmarks.push((*i, landmark));
        }
        let positioned = landmarks.iter().filter(|(_, l)| l.point_in_world.is_some()).count();
        if positioned < self.options.policy.least_inliers {
            return false;
        }
        // Unit of length: the median depth becomes 15, a street's typical one in metres; the road gives the true scale later.
        let mut depths: Vec<f64> =
            landmarks.iter().filter_map(|(_, l)| l.point_in_world.map(|p| p.z)).collect();
        let unit = 15.0 / median(&mut depths).unwrap_or(15.0).max(1e-9);
        let last_pose = last_pose.scaled(unit);
        for (_, landmark) in &mut landmarks {
            landmark.point_in_world = landmark.point_in_world.map(|p| p * unit);
        }
        let segment = self.out.keyframes.len();
        self.out.keyframes.push(vec![CameraFromWorld::identity()]);
        self.fill_in_beginning(beginning, &landmarks, segment, frame, &last_pose);
        self.window = Window::new(self.options.window);
        self.held_height = None;
        self.window.push(Keyframe::new(0, CameraFromWorld::identity()));
        self.window.landmarks = landmarks.into_iter().map(|(_, l)| l).collect();
        let steps = (frame - beginning.first_frame).max(1) as f64;
        self.velocity = CameraFromCamera::exp(&(last_pose.log() / steps));
        self.add_keyframe(frame, last_pose, pyramid, mask);
        self.last = Some((frame, pyramid.clone(), self.newest_pose(last_pose)));
        self.failures = 0;
        let doubt = two_view_covariance(&last_pose) / steps;
        self.out.frames[beginning.first_frame + 1..=frame].iter_mut().for_each(|r| r.covariance += doubt);
        true
    }

    /// Poses of the frames between the first and the present one, against the new map.
    fn fill_in_beginning(
        &mut self,
        beginning: &Beginning,
        landmarks: &[(usize, Landmark)],
        segment: usize,
        frame: usize,
        last_pose: &CameraFromWorld,
    ) {
        let steps = (frame - beginning.first_frame).max(1) as f64;
        let skipped = (frame - beginning.first_frame).saturating_sub(beginning.tracks.len());
        let (mut before, mut refiner) = (CameraFromWorld::identity(), PoseRefiner::default());
        for k in beginning.first_frame..frame {
            // Frames skipped while standing share the first pose.
            let along = (k - beginning.first_frame).saturating_sub(skipped);
            let guess = CameraFromWorld::exp(&(last_pose.log() * (along as f64 / steps)));
            let pixels = along.checked_sub(1).and_then(|t| beginning.tracks.get(t));
            let refined = pixels.and_then(|pixels| {
                let seen = |(i, l): &(usize, Landmark)| {
                    Some(Observation { point_in_world: l.point_in_world?, pixel: pixels[*i]? })
                };
                let observations: Vec<_> = landmarks.iter().filter_map(seen).collect();
                refiner.refine(&self.camera, &guess, &observations, &self.options.pose)
            });
            let record = &mut self.out.frames[k];
            record.segment = segment;
            record.keyframe = 0;
            match refined.filter(|r| r.inlier_count >= self.options.policy.least_inliers) {
                Some(estimate) => {
                    before = estimate.camera_from_world;
                    fill(record, &estimate);
                }
                // The first frame is the map's own origin.
                None if k == beginning.first_frame => record.status = FrameStatus::Tracked,
                None if along == 0 => record.status = FrameStatus::Standstill,
                None => before = guess,
            }
            record.camera_from_keyframe = before.cast();
        }
        // Frames before the first one of this beginning (too dark, tracks lost) are taken to have gone at the speed of the
        // map's first frames, for a second at most: before that nobody knows.
        const BACKWARDS: i32 = 10;
        let back = Pose::<Camera, Camera>::exp(&(last_pose.log() * (-1.0 / steps)));
        let mut pose = CameraFromCamera::identity();
        for (age, record) in (1..).zip(self.out.frames[..beginning.first_frame].iter_mut().rev()) {
            if record.segment != usize::MAX {
                break;
            }
            if age <= BACKWARDS {
                pose = back * pose;
            }
            record.segment = segment;
            record.keyframe = 0;
            record.camera_from_keyframe = pose;
        }
    }
}

/// What two views alone leave open (6×6 `[ω, ν]`): tracking against their map does not tell, its points err with them. Median
/// errors on driving pairs (0.9 m ahead, 0.4 px of noise) are 0.015° of rotation and 0.33° of direction.
fn two_view_covariance(pose: &CameraFromWorld) -> Matrix6<f64> {
    let (turn, aside) = (0.02_f64.to_radians(), 0.4_f64.to_radians() * pose.translation().norm());
    let sigmas = Vector6::new(turn, turn, turn, aside, aside, aside);
    Matrix6::from_diagonal(&sigmas.component_mul(&sigmas))
}

fn median_flow(first: &[Point2<f64>], now: Option<&Vec<Option<Point2<f64>>>>) -> f64 {
    let Some(now) = now else { return 0.0 };
    let mut flow: Vec<f64> = first.iter().zip(now).filter_map(|(a, b)| Some(((*b)? - a).norm())).collect();
    median(&mut flow).unwrap_or(0.0)
}
