//! Initialisation of a map: corners tracked from a first frame until two views determine depth.

use std::ops::Range;

use motorcade_geometry::{
    Camera, RelativePose, RelativePoseOptions, World, relative_pose, robust::median, triangulate_midpoint,
};
use nalgebra::{Matrix2, Point2, Vector3};

use super::velocity::Velocity;
use super::{CameraFromWorld, Frame, LastFrame, Odometry, TemplateFrame};
use crate::map::{Keyframe, Landmark, Window};
use crate::time::ratio;
use crate::tracking::{Pyramid, Request, detect, track_checked};
use crate::trajectory::FrameStatus;

/// Corners tracked from the first frame of the map.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Initialisation {
    pub first_frame: usize,
    pub first_ns: i64,
    pub first_pixels: Vec<Point2<f64>>,
    /// The camera stands up to this frame.
    pub standing: usize,
    /// Pixels in the frames since, in order; none of frames that were skipped.
    pub tracks: Vec<Tracks>,
}

/// Pixels of the first corners in a later frame.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Tracks {
    pub frame: usize,
    pub timestamp_ns: i64,
    /// `None` where lost.
    pub pixels: Vec<Option<Point2<f64>>>,
}

/// Unit ray in each of the two views.
type RayPair = (Vector3<f64>, Vector3<f64>);
/// Index of a corner, and its pixel in the first and the present frame.
type PixelPair = (usize, Point2<f64>, Point2<f64>);

impl Initialisation {
    /// Forgets what was tracked in some frames.
    pub fn skip(&mut self, rows: &Range<usize>) {
        self.tracks.retain(|tracks| !rows.contains(&tracks.frame));
        if rows.contains(&(self.standing + 1)) {
            self.standing = self.first_frame;
        }
    }

    /// Median image motion since the first frame \[px\].
    fn flow_px(&self) -> f64 {
        let Some(tracks) = self.tracks.last() else { return 0.0 };
        let pairs = self.first_pixels.iter().zip(&tracks.pixels);
        let mut flow: Vec<f64> = pairs.filter_map(|(a, b)| Some(((*b)? - a).norm())).collect();
        median(&mut flow).unwrap_or(0.0)
    }

    /// Pixel of a corner in the newest frame, and where constant image motion leads it at `timestamp_ns`.
    fn predict(&self, corner: usize, timestamp_ns: i64) -> Option<(Point2<f64>, Point2<f64>)> {
        let first = self.first_pixels[corner];
        let Some(newest) = self.tracks.last() else { return Some((first, first)) };
        let from = newest.pixels[corner]?;
        let (before, before_ns) = match self.tracks.len() {
            1 => (Some(first), self.first_ns),
            n => (self.tracks[n - 2].pixels[corner], self.tracks[n - 2].timestamp_ns),
        };
        let ahead = ratio(timestamp_ns - newest.timestamp_ns, newest.timestamp_ns - before_ns);
        Some((from, before.map_or(from, |p| from + (from - p) * ahead)))
    }
}

impl Odometry {
    pub(super) fn initialise(&mut self, frame: &Frame<'_>) {
        self.record_initialising(frame.timestamp_ns);
        let Some(mut initialisation) = self.initialisation.take() else {
            self.restart_initialisation(frame);
            return;
        };
        let Some(last) = self.last.take() else { return };
        let pixels = self.track_corners(&last.template.pyramid, frame, &initialisation);
        let alive = pixels.iter().flatten().count();
        initialisation.tracks.push(Tracks { frame: frame.number, timestamp_ns: frame.timestamp_ns, pixels });
        if alive < self.tracks_needed(initialisation.first_pixels.len()) {
            self.restart_initialisation(frame);
            return;
        }
        let policy = &self.options.advanced.policy;
        let flow_px = initialisation.flow_px();
        let needed_px = (policy.begin_flow_rad * self.camera.focal_px()).max(policy.begin_flow_px);
        self.last = Some(LastFrame::at(frame, CameraFromWorld::identity()));
        if flow_px < policy.standstill_px {
            self.trajectory.frames[frame.number].status = FrameStatus::Standstill;
            // While standing, only the first and the present frame are kept.
            initialisation.tracks.truncate(initialisation.tracks.len().saturating_sub(1).max(1));
            if let Some(tracks) = initialisation.tracks.last_mut() {
                (tracks.frame, tracks.timestamp_ns) = (frame.number, frame.timestamp_ns);
            }
            // The pixels that are kept are those of the present frame too.
            initialisation.standing = initialisation.first_frame.max(frame.number - 1);
        }
        if flow_px >= needed_px && self.try_to_initialise(frame, &initialisation) {
            return;
        }
        self.initialisation = Some(initialisation);
    }

    pub(super) fn restart_initialisation(&mut self, frame: &Frame<'_>) {
        let allowed = |x: usize, y: usize| frame.mask.allows(&Point2::new(x as f64, y as f64));
        let first_pixels = detect(frame.pyramid.level(0), &[], allowed, &self.options.corners);
        self.initialisation = Some(Initialisation {
            first_frame: frame.number,
            first_ns: frame.timestamp_ns,
            first_pixels,
            standing: frame.number,
            tracks: Vec::new(),
        });
        self.last = Some(LastFrame::at(frame, CameraFromWorld::identity()));
    }

    /// Tracks that must be left of the first corners.
    fn tracks_needed(&self, corners: usize) -> usize {
        let policy = &self.options.advanced.policy;
        let (least, most) = (policy.least_tracks, policy.begin_tracks);
        ((policy.begin_kept * corners as f64) as usize).clamp(least, most.max(least))
    }

    fn track_corners(
        &self,
        previous: &Pyramid,
        frame: &Frame<'_>,
        initialisation: &Initialisation,
    ) -> Vec<Option<Point2<f64>>> {
        let top_level = self.options.klt.advanced.corner_level;
        let to: &Pyramid = frame.pyramid;
        let track = |corner: usize| {
            let (from, expected) = initialisation.predict(corner, frame.timestamp_ns)?;
            let request = Request { from, expected, from_offset: Matrix2::identity(), top_level };
            track_checked(previous, to, &request, &self.options.klt).filter(|p| frame.mask.allows(p))
        };
        (0..initialisation.first_pixels.len()).map(track).collect()
    }

    /// Two-view geometry between the first and the present frame; on success the map exists and earlier frames have poses.
    fn try_to_initialise(&mut self, frame: &Frame<'_>, initialisation: &Initialisation) -> bool {
        let Some(tracks) = initialisation.tracks.last() else { return false };
        let first = &initialisation.first_pixels;
        let pairs: Vec<PixelPair> =
            (0..first.len()).filter_map(|i| Some((i, first[i], tracks.pixels[i]?))).collect();
        let rays: Vec<RayPair> =
            pairs.iter().map(|(_, a, b)| (self.camera.ray(a), self.camera.ray(b))).collect();
        let advanced = &self.options.advanced.policy;
        let options = RelativePoseOptions {
            seed: self.options.seed,
            ..RelativePoseOptions::for_pixel_noise(advanced.two_view_noise_px, self.camera.focal_px())
        };
        let Some(found) = relative_pose::<Camera, World>(&rays, &options) else { return false };
        if (found.inlier_count as f64) < advanced.two_view_inlier_share * pairs.len() as f64 {
            return false;
        }
        let mut landmarks = self.triangulate_pairs(&pairs, &rays, &found);
        let positioned = landmarks.iter().filter(|(_, l)| l.point_in_world.is_some()).count();
        if positioned < self.options.advanced.policy.least_inliers {
            return false;
        }
        // Unit of length: the road gives the true scale later.
        let mut depths: Vec<f64> =
            landmarks.iter().filter_map(|(_, l)| l.point_in_world.map(|p| p.z)).collect();
        let median_depth = advanced.median_depth;
        let unit = median_depth / median(&mut depths).unwrap_or(median_depth).max(1e-9);
        let last_pose = found.b_from_a.scaled(unit);
        for (_, landmark) in &mut landmarks {
            landmark.point_in_world = landmark.point_in_world.map(|p| p * unit);
        }
        let frames = frame.number - initialisation.first_frame;
        let elapsed_ns = frame.timestamp_ns - initialisation.first_ns;
        self.velocity = Velocity::new(&last_pose.log(), elapsed_ns, frames);
        self.trajectory.keyframes.push(vec![CameraFromWorld::identity()]);
        self.fill_initial_poses(initialisation, &landmarks, frame, &last_pose);
        self.corners += first.len() as u64;
        self.start_map(frame, landmarks.into_iter().map(|(_, l)| l).collect(), last_pose);
        self.add_two_view_covariance(initialisation.first_frame, frame.number, &last_pose);
        true
    }

    /// Landmarks of the tracked corners, with positions where the two views agree and have parallax.
    fn triangulate_pairs(
        &self,
        pairs: &[PixelPair],
        rays: &[RayPair],
        found: &RelativePose<Camera, World>,
    ) -> Vec<(usize, Landmark)> {
        let cosine_limit = self.options.advanced.window.least_parallax_rad.cos();
        let landmark = |(((i, a, b), ray), inlier): ((&PixelPair, &RayPair), &bool)| {
            let triangulated =
                inlier.then(|| triangulate_midpoint(&ray.0, &ray.1, &found.b_from_a)).flatten();
            let point_in_world = triangulated.filter(|(_, c)| *c < cosine_limit).map(|(p, _)| p);
            (
                *i,
                Landmark {
                    pixel: Some(*b),
                    point_in_world,
                    ..Landmark::new(self.corners + *i as u64, *a, 0)
                },
            )
        };
        pairs.iter().zip(rays).zip(&found.inliers).map(landmark).collect()
    }

    /// A map of two keyframes, the first frame and the present one.
    fn start_map(&mut self, frame: &Frame<'_>, landmarks: Vec<Landmark>, last_pose: CameraFromWorld) {
        self.window = Window::new(self.options.advanced.window);
        (self.held_log_height, self.contradicted_since_ns) = (None, None);
        self.window.push(Keyframe::new(0, CameraFromWorld::identity(), self.row_motion()));
        self.window.landmarks = landmarks;
        self.add_keyframe(frame, last_pose);
        self.last = Some(LastFrame::at(frame, self.newest_pose(last_pose)));
        self.renew_templates();
        self.failing_ns = 0;
        self.standstill.stands = false;
        self.renew_standstill_reference(frame.timestamp_ns);
    }
}

impl LastFrame {
    /// A frame that the next one is tracked from.
    pub(super) fn at(frame: &Frame<'_>, camera_from_world: CameraFromWorld) -> Self {
        let template = TemplateFrame {
            timestamp_ns: frame.timestamp_ns,
            pyramid: frame.pyramid.clone(),
            camera_from_world,
        };
        Self { frame: frame.number, timestamp_ns: frame.timestamp_ns, camera_from_world, template }
    }
}
