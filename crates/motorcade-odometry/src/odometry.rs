//! Monocular odometry up to scale: corners followed by KLT, pose against the local map, keyframes, windowed bundle
//! adjustment. A break starts a new segment with a scale of its own.

use std::sync::Arc;

use image::GrayImage;
use motorcade_geometry::{
    Camera, PinholeCamera, Pose, RelativePoseOptions, World, relative_pose, robust::median,
    triangulate_midpoint,
};
use nalgebra::{Matrix2, Matrix6, Point2, Point3};

use crate::corners::{CornerOptions, detect};
use crate::klt::{KltOptions, Request, track_checked};
use crate::landmark::Landmark;
use crate::pose_only::{Observation, PoseEstimate, PoseOnlyOptions, refine_pose};
use crate::pyramid::Pyramid;
use crate::static_mask::StaticMask;
use crate::window::{Keyframe, Window, WindowOptions};

type CameraFromWorld = Pose<Camera, World>;
type CameraFromCamera = Pose<Camera, Camera>;

/// All settings of the odometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryOptions {
    /// Corner detection.
    pub corners: CornerOptions,
    /// Tracking.
    pub klt: KltOptions,
    /// Pose against the map.
    pub pose: PoseOnlyOptions,
    /// Local map.
    pub window: WindowOptions,
    /// Keyframes and breaks.
    pub policy: PolicyOptions,
    /// Seed of the two-view sampling.
    pub seed: u64,
}

/// When to begin, to take a keyframe, to give up.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PolicyOptions {
    /// Median image motion that lets a map begin \[rad, pixels over focal length\]: a degree, 12 px of a KITTI camera.
    pub begin_flow_rad: f64,
    /// Tracks a map begins with at least.
    pub begin_tracks: usize,
    /// Median image motion of landmarks since the last keyframe that asks for another \[rad\]: 30 px of a KITTI camera.
    pub keyframe_flow_rad: f64,
    /// Share of the last keyframe's landmarks still tracked below which another is taken.
    pub keyframe_kept: f64,
    /// Median image motion below which the camera is standing \[px\]: above the noise of tracking.
    pub standstill_px: f64,
    /// Landmarks that must agree on a pose.
    pub least_inliers: usize,
    /// Failed frames in a row after which a new segment begins.
    pub give_up_after: usize,
}

impl Default for PolicyOptions {
    fn default() -> Self {
        Self {
            begin_flow_rad: 0.0166,
            begin_tracks: 60,
            keyframe_flow_rad: 0.0416,
            keyframe_kept: 0.5,
            standstill_px: 0.25,
            least_inliers: 15,
            give_up_after: 5,
        }
    }
}

/// What is known of a frame's pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameStatus {
    /// No map yet; the pose is filled in when one begins.
    Initialising,
    /// Tracked against the map.
    Tracked,
    /// The camera stood still: the pose of the frame before.
    Standstill,
    /// Not tracked (missing, corrupt, covered): bridged between its neighbours.
    Bridged,
}

/// A frame's pose, relative to a keyframe so that later adjustments move it along.
#[derive(Clone, Debug)]
pub struct FrameRecord {
    /// How it was found.
    pub status: FrameStatus,
    /// Segment it belongs to.
    pub segment: usize,
    /// Keyframe number within the segment.
    pub keyframe: usize,
    /// Pose relative to that keyframe.
    pub camera_from_keyframe: CameraFromCamera,
    /// Landmarks that agreed.
    pub inliers: usize,
    /// Reprojection error of the inliers \[px\].
    pub rms_px: f64,
    /// Covariance of the pose against the map (6×6 `[ω, ν]`, translation in the segment's unit).
    pub covariance: Matrix6<f64>,
}

/// Frame poses of one segment, in the segment's own unit of length.
#[derive(Clone, Debug)]
pub struct UpToScale {
    /// One record a frame, in order.
    pub frames: Vec<FrameRecord>,
    /// `camera_from_world` of each keyframe of each segment.
    pub keyframes: Vec<Vec<CameraFromWorld>>,
}

impl UpToScale {
    /// A trajectory from elsewhere, as one segment in its own unit. `world_from_camera` of every frame.
    pub fn from_poses(poses: &[Pose<World, Camera>]) -> Self {
        let keyframes: Vec<CameraFromWorld> = poses.iter().map(Pose::inverse).collect();
        let frame = |keyframe: usize| {
            // What a good odometry errs from frame to frame: 0.02° and 1 % of the step.
            let step = keyframe
                .checked_sub(1)
                .map_or(0.0, |b| (poses[keyframe].translation() - poses[b].translation()).norm());
            let (turn, shift) = (0.02_f64.to_radians().powi(2), (0.01 * step).powi(2) + 1e-8);
            FrameRecord {
                status: FrameStatus::Tracked,
                segment: 0,
                keyframe,
                camera_from_keyframe: CameraFromCamera::identity(),
                inliers: 0,
                rms_px: 0.0,
                covariance: Matrix6::from_diagonal(&nalgebra::Vector6::new(
                    turn, turn, turn, shift, shift, shift,
                )),
            }
        };
        Self { frames: (0..poses.len()).map(frame).collect(), keyframes: vec![keyframes] }
    }

    /// `camera_from_world` of a frame in its segment's world; `None` while its segment has no map.
    pub fn camera_from_world(&self, frame: usize) -> Option<CameraFromWorld> {
        let record = self.frames.get(frame)?;
        let keyframe = self.keyframes.get(record.segment)?.get(record.keyframe)?;
        Some(record.camera_from_keyframe * *keyframe)
    }
}

/// Corners followed from the frame where the map may begin.
struct Beginning {
    first_frame: usize,
    first_pixels: Vec<Point2<f64>>,
    /// Pixels per frame since, `None` where lost.
    tracks: Vec<Vec<Option<Point2<f64>>>>,
}

/// The odometry; frames go in one by one.
pub struct Odometry {
    camera: PinholeCamera,
    options: OdometryOptions,
    out: UpToScale,
    window: Window,
    beginning: Option<Beginning>,
    /// Last frame whose tracks hold: its number, pyramid and pose.
    last: Option<(usize, Arc<Pyramid>, CameraFromWorld)>,
    /// Motion per frame interval, `camera_from_camera` of the last tracked pair.
    velocity: CameraFromCamera,
    failures: usize,
}

const PYRAMID_LEVELS: usize = 4;

impl Odometry {
    /// Ready for the first frame.
    pub fn new(camera: PinholeCamera, options: OdometryOptions) -> Self {
        Self {
            camera,
            options,
            out: UpToScale { frames: Vec::new(), keyframes: Vec::new() },
            window: Window::new(options.window),
            beginning: None,
            last: None,
            velocity: CameraFromCamera::identity(),
            failures: 0,
        }
    }

    /// Poses so far.
    pub fn so_far(&self) -> &UpToScale {
        &self.out
    }

    /// The landmarks of the local map.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.window.landmarks
    }

    /// A frame that could not be read: its pose is bridged.
    pub fn skip(&mut self) {
        if self.beginning.is_some() || self.last.is_none() {
            self.beginning = None;
            self.record_initialising();
        } else {
            self.bridge();
        }
    }

    /// Takes the next frame; returns its pyramid for the stages that look at the same pixels.
    pub fn process(&mut self, image: &GrayImage, mask: &StaticMask<'_>) -> Arc<Pyramid> {
        let pyramid = Arc::new(Pyramid::new(image, PYRAMID_LEVELS));
        if self.window.newest().is_none() {
            self.begin(&pyramid, mask);
        } else {
            self.advance(&pyramid, mask);
        }
        pyramid
    }

    /// Ends the run: every frame with its final pose.
    pub fn finish(mut self) -> UpToScale {
        self.close_segment();
        self.out
    }

    // ---- beginning a map ------------------------------------------------------------------------------------------

    fn begin(&mut self, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
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

    fn restart_beginning(&mut self, frame: usize, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
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
        self.window.push(Keyframe { number: 0, camera_from_world: CameraFromWorld::identity() });
        self.window.landmarks = landmarks.into_iter().map(|(_, l)| l).collect();
        let steps = (frame - beginning.first_frame).max(1) as f64;
        self.velocity = CameraFromCamera::exp(&(last_pose.log() / steps));
        self.add_keyframe(frame, last_pose, pyramid, mask);
        self.last = Some((frame, pyramid.clone(), self.newest_pose(last_pose)));
        self.failures = 0;
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
        let mut before = CameraFromWorld::identity();
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
                refine_pose(&self.camera, &guess, &observations, &self.options.pose)
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

    // ---- advancing ------------------------------------------------------------------------------------------------

    fn advance(&mut self, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
        let Some((last_frame, last_pyramid, last_pose)) = self.last.take() else { return };
        let frame = self.out.frames.len();
        let predicted = (last_frame..frame).fold(last_pose, |pose, _| self.velocity.cast() * pose);
        let pixels = self.follow_landmarks(&last_pyramid, pyramid, &last_pose, &predicted, mask);
        let still = self.is_standstill(&pixels);
        let estimate = self.locate(&predicted, &last_pose, &pixels);
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
        self.commit_pixels(&pixels, &estimate);
        self.window.triangulate_tracked(&self.camera, &estimate.camera_from_world);
        let pose = if still { last_pose } else { estimate.camera_from_world };
        let step: CameraFromCamera = (pose * last_pose.inverse()).cast();
        self.velocity = CameraFromCamera::exp(&(step.log() / (frame - last_frame) as f64));
        self.record(&estimate, pose, if still { FrameStatus::Standstill } else { FrameStatus::Tracked });
        self.last = Some((frame, pyramid.clone(), pose));
        if !still && self.wants_keyframe() {
            self.add_keyframe(frame, pose, pyramid, mask);
            self.last = Some((frame, pyramid.clone(), self.newest_pose(pose)));
        }
    }

    /// New pixel of every landmark, `None` where lost.
    fn follow_landmarks(
        &self,
        from: &Pyramid,
        to: &Pyramid,
        last_pose: &CameraFromWorld,
        predicted: &CameraFromWorld,
        mask: &StaticMask<'_>,
    ) -> Vec<Option<Point2<f64>>> {
        /// A depth without parallax, in the segment's unit.
        const FAR: f64 = 1e4;
        let motion: CameraFromCamera = (*predicted * last_pose.inverse()).cast();
        let depths = NearbyDepths::new(&self.window.landmarks, last_pose);
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
            track_checked(from, to, &request, &self.options.klt).filter(|p| mask.allows(p))
        };
        self.window.landmarks.iter().map(one).collect()
    }

    fn is_standstill(&self, pixels: &[Option<Point2<f64>>]) -> bool {
        let moves =
            self.window.landmarks.iter().zip(pixels).filter_map(|(l, p)| Some(((*p)? - l.pixel?).norm()));
        let mut moves: Vec<f64> = moves.collect();
        let enough = moves.len() >= self.options.policy.least_inliers;
        enough && median(&mut moves).is_some_and(|m| m < self.options.policy.standstill_px)
    }

    fn locate(
        &self,
        predicted: &CameraFromWorld,
        last_pose: &CameraFromWorld,
        pixels: &[Option<Point2<f64>>],
    ) -> Option<PoseEstimate> {
        let observation = |(l, p): (&Landmark, &Option<Point2<f64>>)| {
            Some(Observation { point_in_world: l.point_in_world?, pixel: (*p)? })
        };
        let observations: Vec<Observation> =
            self.window.landmarks.iter().zip(pixels).filter_map(observation).collect();
        let good = |e: &PoseEstimate| {
            e.inlier_count >= self.options.policy.least_inliers
                && 10 * e.inlier_count >= 4 * observations.len()
        };
        let direct = refine_pose(&self.camera, predicted, &observations, &self.options.pose).filter(good);
        direct.or_else(|| {
            // A sudden turn or stop: begin from the pose before.
            refine_pose(&self.camera, last_pose, &observations, &self.options.pose).filter(good)
        })
    }

    fn commit_pixels(&mut self, pixels: &[Option<Point2<f64>>], estimate: &PoseEstimate) {
        const STRIKES: u8 = 3;
        let mut verdicts = estimate.inliers.iter();
        for (landmark, pixel) in self.window.landmarks.iter_mut().zip(pixels) {
            if landmark.point_in_world.is_some() && pixel.is_some() {
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

    fn wants_keyframe(&self) -> bool {
        let Some(newest) = self.window.newest() else { return false };
        let seen_then = self.window.landmarks.iter().filter_map(|l| {
            l.sightings.last().filter(|(n, _)| *n == newest.number).map(|(_, then)| (l.pixel, then))
        });
        let (mut flow, mut total) = (Vec::new(), 0);
        for (now, then) in seen_then {
            total += 1;
            flow.extend(now.map(|p| (p - then).norm()));
        }
        let kept = flow.len() as f64 / f64::from(total.max(1));
        kept < self.options.policy.keyframe_kept
            || median(&mut flow)
                .is_none_or(|m| m > self.options.policy.keyframe_flow_rad * self.camera.focal_px())
    }

    fn add_keyframe(
        &mut self,
        frame: usize,
        pose: CameraFromWorld,
        pyramid: &Pyramid,
        mask: &StaticMask<'_>,
    ) {
        let segment = self.out.keyframes.len() - 1;
        let number = self.out.keyframes[segment].len();
        self.out.keyframes[segment].push(pose);
        self.window.push(Keyframe { number, camera_from_world: pose });
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
        let allowed = |x: usize, y: usize| mask.allows(&Point2::new(x as f64, y as f64));
        let fresh = detect(pyramid.level(0), &occupied, allowed, &self.options.corners);
        self.window.landmarks.extend(fresh.into_iter().map(|p| Landmark::new(p, number)));
    }

    fn newest_pose(&self, fallback: CameraFromWorld) -> CameraFromWorld {
        self.window.newest().map_or(fallback, |k| k.camera_from_world)
    }

    // ---- breaks ---------------------------------------------------------------------------------------------------

    fn start_over(&mut self, frame: usize, pyramid: &Arc<Pyramid>, mask: &StaticMask<'_>) {
        self.close_segment();
        self.failures = 0;
        self.restart_beginning(frame, pyramid, mask);
        if let Some(record) = self.out.frames.last_mut() {
            record.segment = usize::MAX;
            record.status = FrameStatus::Initialising;
            record.camera_from_keyframe = CameraFromCamera::identity();
        }
    }

    fn close_segment(&mut self) {
        self.window = Window::new(self.options.window);
        self.last = None;
        self.beginning = None;
    }

    // ---- records --------------------------------------------------------------------------------------------------

    fn record_initialising(&mut self) {
        self.out.frames.push(FrameRecord {
            status: FrameStatus::Initialising,
            segment: usize::MAX,
            keyframe: 0,
            camera_from_keyframe: CameraFromCamera::identity(),
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        });
    }

    fn record(&mut self, estimate: &PoseEstimate, pose: CameraFromWorld, status: FrameStatus) {
        let segment = self.out.keyframes.len() - 1;
        let Some(newest) = self.window.newest() else { return };
        let mut record = FrameRecord {
            status,
            segment,
            keyframe: newest.number,
            camera_from_keyframe: (pose * newest.camera_from_world.inverse()).cast(),
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        };
        let kept = record.status;
        fill(&mut record, estimate);
        record.status = kept;
        self.out.frames.push(record);
    }

    fn bridge(&mut self) {
        let before = self.out.frames.last();
        let moved = before.map_or(CameraFromCamera::identity(), |b| self.velocity * b.camera_from_keyframe);
        let (segment, keyframe) = before.map_or((usize::MAX, 0), |b| (b.segment, b.keyframe));
        self.out.frames.push(FrameRecord {
            status: FrameStatus::Bridged,
            segment,
            keyframe,
            camera_from_keyframe: moved,
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        });
    }
}

/// Depths of landmarks by their place in the image: the guess for those that have none yet.
struct NearbyDepths {
    /// Pixel and inverse depth.
    known: Vec<(Point2<f64>, f64)>,
}

impl NearbyDepths {
    fn new(landmarks: &[Landmark], camera_from_world: &CameraFromWorld) -> Self {
        let one = |l: &Landmark| {
            let z = camera_from_world.transform_point(&l.point_in_world?).z;
            (z > 0.0).then_some((l.pixel?, 1.0 / z))
        };
        Self { known: landmarks.iter().filter_map(one).collect() }
    }
    /// Median depth of the five nearest; rows count four times columns, since on a road depth changes from row to row.
    fn around(&self, pixel: &Point2<f64>) -> Option<f64> {
        const NEIGHBOURS: usize = 5;
        let mut nearest = [(f64::MAX, 0.0); NEIGHBOURS];
        for (p, inverse_depth) in &self.known {
            let d = p - pixel;
            let distance = d.x * d.x + 16.0 * d.y * d.y;
            if distance < nearest[NEIGHBOURS - 1].0 {
                nearest[NEIGHBOURS - 1] = (distance, *inverse_depth);
                nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
            }
        }
        let mut inverse: Vec<f64> = nearest.iter().filter(|n| n.0 < f64::MAX).map(|n| n.1).collect();
        median(&mut inverse).map(|d| 1.0 / d)
    }
}

fn fill(record: &mut FrameRecord, estimate: &PoseEstimate) {
    record.status = FrameStatus::Tracked;
    record.inliers = estimate.inlier_count;
    record.rms_px = estimate.inlier_rms_px;
    // A floor on the pixel noise: three points can fit perfectly.
    let sigma = estimate.inlier_rms_px.max(0.1);
    record.covariance = estimate.information.try_inverse().unwrap_or_else(Matrix6::zeros) * (sigma * sigma);
}

fn median_flow(first: &[Point2<f64>], now: Option<&Vec<Option<Point2<f64>>>>) -> f64 {
    let Some(now) = now else { return 0.0 };
    let mut flow: Vec<f64> = first.iter().zip(now).filter_map(|(a, b)| Some(((*b)? - a).norm())).collect();
    median(&mut flow).unwrap_or(0.0)
}
