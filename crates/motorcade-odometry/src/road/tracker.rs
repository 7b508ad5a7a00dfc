//! The road plane from frame to frame: search, tracking, and search after a loss.

mod state;

use std::sync::Arc;

use motorcade_geometry::{BoundingBox, Camera, PinholeCamera, Pose, World};
use nalgebra::{Point2, Vector3};

pub use state::RoadTrackerState;

use super::alignment::align_road;
use super::history::{EarlierFrame, RoadHistory};
use super::measurement::{RoadMeasurement, forget_before};
use super::options::{PlaneTrackingOptions, RoadOptions};
use super::pixels::RoadPixels;
use super::plane::AlignedRoad;
use super::view::{RoadScratch, RoadView};
use super::watch::{HeightWatch, WatchedFrame};
use crate::rolling_shutter::row_share;
use crate::time::{nanoseconds, seconds};
use crate::tracking::Pyramid;

/// A frame, for the road.
#[derive(Clone, Copy)]
pub struct RoadInput<'a> {
    /// Number of the frame (row of the run).
    pub frame: usize,
    /// Time of the frame \[ns\].
    pub timestamp_ns: i64,
    /// Segment of the odometry; `usize::MAX` before its map begins.
    pub segment: usize,
    /// The image.
    pub pyramid: &'a Arc<Pyramid>,
    /// Boxes of all vehicles, moving or not: they hide the road in this frame, and when it serves as the earlier one.
    pub vehicles: &'a [BoundingBox],
    /// True with a road mask.
    pub masked: bool,
}

/// Frames in which the road mirrored what stands above it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct MirroredFrames {
    /// Row of the first one.
    pub first: usize,
    /// Number of aligned frames.
    pub frames: usize,
}

/// Tracks the road plane through a drive.
pub struct RoadTracker {
    camera: PinholeCamera,
    options: RoadOptions,
    history: RoadHistory,
    /// Present plane m in the odometry's unit.
    plane: Option<Vector3<f64>>,
    /// Slow average of log |m|: the odometry's unit is held, so a plane that drifts away from it is false.
    anchor: Option<f64>,
    /// Normal of the last known plane: a new segment has another unit but the same camera.
    normal: Vector3<f64>,
    /// The height by the likelihood of many frames: where the plane is searched, and what it must agree with.
    watch: HeightWatch,
    segment: usize,
    /// Time of failed alignments in a row \[ns\].
    failing_ns: i64,
    /// Time without a plane \[ns\].
    lost_ns: i64,
    /// Half width of the stretch without a road mask \[camera heights\].
    unmasked_half_width: f64,
    measurements: Vec<RoadMeasurement>,
    /// Frames in which the road mirrored.
    mirrored: Option<MirroredFrames>,
    scratch: RoadScratch,
}

impl RoadTracker {
    /// A tracker without a plane.
    pub fn new(camera: PinholeCamera, options: RoadOptions) -> Self {
        Self {
            camera,
            options,
            history: RoadHistory::default(),
            plane: None,
            anchor: None,
            normal: Vector3::y(),
            watch: HeightWatch::new(options.advanced.height, options.readout_s),
            segment: 0,
            failing_ns: 0,
            lost_ns: 0,
            unmasked_half_width: options.unmasked_half_width_heights,
            measurements: Vec::new(),
            mirrored: None,
            scratch: RoadScratch::default(),
        }
    }

    /// All measurements so far, in order of frames.
    pub fn measurements(&self) -> &[RoadMeasurement] {
        &self.measurements
    }

    /// Frames in which the road mirrored what stands above it: their metres come from points and their mirror images.
    pub fn mirrored(&self) -> Option<MirroredFrames> {
        self.mirrored
    }

    /// The oldest frame that the next one may be compared with.
    pub fn oldest(&self) -> Option<usize> {
        self.history.oldest()
    }

    /// Takes out measurements of frames before `frame`, many at once, but for the newest.
    pub fn forget_before(&mut self, frame: usize) -> Vec<RoadMeasurement> {
        forget_before(&mut self.measurements, frame)
    }

    /// Puts back the measurements that were taken out.
    pub fn put_back(&mut self, older: Vec<RoadMeasurement>) {
        drop(self.measurements.splice(..0, older));
    }

    /// Ends the drive: all measurements but those taken out.
    pub fn finish(self) -> Vec<RoadMeasurement> {
        self.measurements
    }

    /// The tracked plane in the odometry's unit; m with `mᵀX = 1`.
    pub fn plane(&self) -> Option<Vector3<f64>> {
        self.plane
    }

    /// Processes a frame and returns its measurement, if the road could be aligned; frames less than
    /// [`RoadOptions::interval_s`] after the last one are not aligned. `pose_of` gives `camera_from_world` of it and of earlier
    /// frames of the segment, as far as they were measured, `usable` the pixels that may be road.
    pub fn process(
        &mut self,
        input: &RoadInput<'_>,
        pose_of: impl Fn(usize) -> Option<Pose<Camera, World>>,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<RoadMeasurement> {
        if input.segment != self.segment {
            self.start_segment(input, &pose_of);
        }
        let elapsed_ns = self.history.newest_ns().map_or(0, |before| input.timestamp_ns - before);
        let is_first = self.history.newest_ns().is_none();
        if !is_first && (0..nanoseconds(self.options.interval_s)).contains(&elapsed_ns) {
            return None;
        }
        self.history.remove_before(input.timestamp_ns - nanoseconds(self.options.advanced.oldest_s));
        let road = self.road_pixels(input, usable);
        let measured = pose_of(input.frame).and_then(|camera_from_world| {
            let current = Current { input, camera_from_world, elapsed_ns: elapsed_ns.max(0), road: &road };
            let watched = self.watch(&current, &pose_of);
            // The picture of a road that mirrors aligns by a plane below it.
            let aligned = !self.watch.mirrors();
            if self.plane.is_none() && aligned {
                self.start(elapsed_ns.max(0));
            }
            let tracked =
                self.plane.filter(|_| aligned).and_then(|plane| self.track(&current, plane, &pose_of));
            tracked.or(watched)
        });
        let (frame, timestamp_ns, pyramid) = (input.frame, input.timestamp_ns, input.pyramid.clone());
        self.history.push(EarlierFrame { frame, timestamp_ns, pyramid, road });
        self.measurements.extend(measured);
        measured
    }

    /// Forgets what belongs to the unit of the segment before. Frames from which the new map was made have got their poses with it: their height is
    /// watched now, so that a few frames a second need no longer than many.
    fn start_segment(
        &mut self,
        input: &RoadInput<'_>,
        pose_of: &impl Fn(usize) -> Option<Pose<Camera, World>>,
    ) {
        let was_initialising = self.segment == usize::MAX;
        (self.segment, self.plane, self.anchor) = (input.segment, None, None);
        (self.failing_ns, self.lost_ns) = (0, 0);
        self.watch.reset();
        let earlier = self.history.take();
        for frame in earlier.into_iter().filter(|_| was_initialising) {
            let Some(camera_from_world) = pose_of(frame.frame) else { continue };
            let before = RoadInput {
                frame: frame.frame,
                timestamp_ns: frame.timestamp_ns,
                pyramid: &frame.pyramid,
                // Only a road that mirrors asks for them, and that is not known of a new segment.
                vehicles: &[],
                ..*input
            };
            let current = Current { input: &before, camera_from_world, elapsed_ns: 0, road: &frame.road };
            let measured = self.watch(&current, pose_of);
            self.measurements.extend(measured);
            self.history.push(frame);
        }
    }

    /// Road pixels of this frame, for itself and for later ones.
    fn road_pixels(&mut self, input: &RoadInput<'_>, usable: impl Fn(&Point2<f64>) -> bool) -> RoadPixels {
        let mut road = self.history.take_spare();
        let tracking = &self.options.advanced.tracking;
        // Pixels beyond twice the stretch and above the horizon are never used.
        let reach = 2.0 * self.options.far_heights;
        let near = |p: &Point2<f64>| self.normal.dot(&self.camera.ray(p)) * reach > 1.0;
        let hidden =
            |p: &Point2<f64>| input.vehicles.iter().any(|v| with_shadow(v, tracking).contains(p.x, p.y));
        road.fill(&self.camera, |p| near(p) && usable(p) && !hidden(p));
        road
    }

    /// Options with the half width of this frame's stretch.
    fn frame_options(&self, masked: bool) -> RoadOptions {
        let half_width_heights =
            if masked { self.options.half_width_heights } else { self.unmasked_half_width };
        RoadOptions { half_width_heights, ..self.options }
    }

    /// Aligns a known plane.
    fn track(
        &mut self,
        current: &Current<'_>,
        plane: Vector3<f64>,
        pose_of: &impl Fn(usize) -> Option<Pose<Camera, World>>,
    ) -> Option<RoadMeasurement> {
        // A shorter baseline, at standstill or walking pace, has too little parallax.
        let least_baseline = self.options.advanced.baseline_heights / plane.norm();
        let (earlier, motion) =
            self.history.reference(&current.camera_from_world, pose_of, least_baseline)?;
        let mut scratch = std::mem::take(&mut self.scratch);
        let reference = earlier.frame;
        let view = self.view(current, earlier, motion, self.normal * plane.norm());
        let options = self.frame_options(current.input.masked);
        let tracking = &options.advanced.tracking;
        // Smooth asphalt has false minima with residuals as small as the true one, but the camera's height does not jump.
        let (anchor, watch) = (self.anchor, &self.watch);
        let plausible = |found: &AlignedRoad| {
            (found.m.norm() / plane.norm()).ln().abs() < tracking.most_jump
                && near_anchor(anchor, &found.m, tracking)
                && watch.agrees(&found.m)
        };
        let usable = |p: &Point2<f64>| current.road.contains(p);
        let found = align_road(&view, usable, &options, &mut scratch).filter(plausible);
        self.scratch = scratch;
        self.adapt_width(found.as_ref());
        let Some(found) = found else {
            self.failing_ns += current.elapsed_ns;
            if self.failing_ns >= nanoseconds(tracking.give_up_s) {
                (self.plane, self.failing_ns) = (None, 0);
            }
            return None;
        };
        self.failing_ns = 0;
        let updated = plane + (found.m - plane) * tracking.gain;
        self.plane = Some(updated);
        let swing = 1.0 - (-seconds(current.elapsed_ns) / tracking.normal_s).exp();
        self.normal = (self.normal + (found.m.normalize() - self.normal) * swing).normalize();
        let rate = (seconds(current.elapsed_ns) / tracking.anchor_s).min(1.0);
        self.anchor = self.anchor.map(|a| a + rate * (found.m.norm().ln() - a));
        Some(RoadMeasurement::new(current.input.frame, reference, motion.translation().norm(), &found))
    }

    /// Watches the height; what this frame says of it.
    fn watch(
        &mut self,
        current: &Current<'_>,
        pose_of: &impl Fn(usize) -> Option<Pose<Camera, World>>,
    ) -> Option<RoadMeasurement> {
        let frame = WatchedFrame {
            camera: &self.camera,
            frame: current.input.frame,
            timestamp_ns: current.input.timestamp_ns,
            camera_from_world: &current.camera_from_world,
            pyramid: current.input.pyramid,
            road: current.road,
            far_heights: self.options.far_heights,
            vehicles: current.input.vehicles,
        };
        let mirrored_before = self.watch.mirrors();
        let anchor = self.anchor;
        let near = |m: &RoadMeasurement| {
            anchor.is_none_or(|a| {
                (m.state.log_inverse_height - a).abs() < self.options.advanced.tracking.most_drift
            })
        };
        let found = self.watch.process(&frame, &self.history, pose_of);
        if self.watch.mirrors() {
            let first = self.mirrored.map_or(current.input.frame, |m| m.first);
            let frames = 1 + self.mirrored.map_or(0, |m| m.frames);
            self.mirrored = Some(MirroredFrames { first, frames });
            if !mirrored_before {
                (self.plane, self.anchor) = (None, None);
            }
        }
        found.filter(near)
    }

    /// Starts with the height that the frames so far agree on; after a loss it must be near the height before, for a while.
    fn start(&mut self, elapsed_ns: i64) {
        self.lost_ns += elapsed_ns;
        let tracking = &self.options.advanced.tracking;
        let Some((normal, height)) = self.watch.down().zip(self.watch.estimate()) else { return };
        let plane = normal * height.log_inverse_height.exp();
        let distrusted = self.lost_ns > nanoseconds(tracking.distrust_anchor_s);
        if distrusted || near_anchor(self.anchor, &plane, tracking) {
            self.anchor = self.anchor.filter(|_| !distrusted).or(Some(height.log_inverse_height));
            (self.plane, self.normal, self.lost_ns) = (Some(plane), normal, 0);
        }
    }

    fn view<'a>(
        &'a self,
        current: &Current<'a>,
        earlier: &'a EarlierFrame,
        reference_from_current: Pose<Camera, Camera>,
        guess: Vector3<f64>,
    ) -> RoadView<'a> {
        let both = self.options.advanced.both_pictures;
        RoadView {
            camera: &self.camera,
            current: current.input.pyramid,
            reference: &earlier.pyramid,
            road_in_reference: if both { &earlier.road } else { RoadPixels::everywhere() },
            reference_from_current,
            guess,
            row_share: row_share(
                self.options.readout_s,
                &self.camera,
                current.input.timestamp_ns - earlier.timestamp_ns,
            ),
        }
    }

    /// Widens the unmasked stretch when it does not align or has too little texture, narrows it when it has plenty.
    fn adapt_width(&mut self, found: Option<&AlignedRoad>) {
        let tracking = &self.options.advanced.tracking;
        let wanted = tracking.unmasked_pixels;
        let factor = match found.map_or(0, |f| f.pixels) {
            n if n < wanted => tracking.width_step,
            n if n > 2 * wanted => 1.0 / tracking.width_step,
            _ => 1.0,
        };
        let narrow = self.options.unmasked_half_width_heights;
        let wide = tracking.unmasked_widest_heights.max(narrow);
        self.unmasked_half_width = (self.unmasked_half_width * factor).clamp(narrow, wide);
    }
}

/// The frame in work.
struct Current<'a> {
    input: &'a RoadInput<'a>,
    camera_from_world: Pose<Camera, World>,
    /// Time since the frame before \[ns\].
    elapsed_ns: i64,
    road: &'a RoadPixels,
}

/// True when a plane is about as far away as the segment has had it so far; `anchor` is its log |m|.
fn near_anchor(anchor: Option<f64>, m: &Vector3<f64>, options: &PlaneTrackingOptions) -> bool {
    anchor.is_none_or(|a| (m.norm().ln() - a).abs() < options.most_drift)
}

/// A box with the vehicle's shadow, which moves with the vehicle.
fn with_shadow(vehicle: &BoundingBox, options: &PlaneTrackingOptions) -> BoundingBox {
    let y2 = vehicle.y2 + options.shadow * (vehicle.y2 - vehicle.y1);
    BoundingBox { y2, ..*vehicle }.grown(options.rim_px)
}
