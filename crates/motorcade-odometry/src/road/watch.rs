//! Watches the camera's height: direction of travel, likelihood of this frame's pairs, what has been accumulated.

use motorcade_geometry::{BoundingBox, Camera, PinholeCamera, Pose, World};
use nalgebra::{Matrix3, Point2, Vector3};
use serde::{Deserialize, Serialize};

use super::height::{
    FilterState, HeightEstimate, HeightFilter, HeightOptions, HeightSamples, MirrorPair, MirrorState,
    MirrorTest, MirrorView, Travel,
};
use super::history::{EarlierFrame, RoadHistory};
use super::measurement::RoadMeasurement;
use super::pixels::RoadPixels;
use super::plane::coordinates;
use super::state::RoadState;
use crate::rolling_shutter::row_share;
use crate::time::seconds;
use crate::tracking::Pyramid;

/// The frame to compare with earlier ones.
pub(super) struct WatchedFrame<'a> {
    pub camera: &'a PinholeCamera,
    pub frame: usize,
    pub timestamp_ns: i64,
    pub camera_from_world: &'a Pose<Camera, World>,
    pub pyramid: &'a Pyramid,
    pub road: &'a RoadPixels,
    pub far_heights: f64,
    /// Boxes of vehicles, which may move.
    pub vehicles: &'a [BoundingBox],
}

/// Place of an earlier frame in the history, newest first, with `reference_from_current`.
type Pair = (usize, Pose<Camera, Camera>);

/// The camera's height by the frames so far.
pub(super) struct HeightWatch {
    options: HeightOptions,
    readout_s: f64,
    filter: HeightFilter,
    travel: Travel,
    samples: HeightSamples,
    mirror: MirrorTest,
    /// Points and their mirror images of this frame, kept for their memory.
    mirrored: Vec<MirrorPair>,
    /// Time of the frame last compared \[ns\].
    compared_ns: Option<i64>,
    /// Pairs of this frame, and log likelihoods by it; kept for their memory.
    pairs: Vec<Pair>,
    log_likelihood: Vec<f64>,
    /// Time since the whole range of heights was compared \[s\].
    since_whole_s: f64,
}

/// State of a [`HeightWatch`] between two frames.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct WatchState {
    filter: FilterState,
    travel: Travel,
    mirror: MirrorState,
    compared_ns: Option<i64>,
    since_whole_s: f64,
}

impl HeightWatch {
    /// `readout_s` is the time in which the rows of a picture are read.
    pub fn new(options: HeightOptions, readout_s: f64) -> Self {
        Self {
            options,
            readout_s,
            filter: HeightFilter::new(options),
            travel: Travel::default(),
            samples: HeightSamples::default(),
            mirror: MirrorTest::new(options.mirror),
            mirrored: Vec::new(),
            compared_ns: None,
            pairs: Vec::with_capacity(options.most_pairs),
            log_likelihood: Vec::new(),
            since_whole_s: 0.0,
        }
    }

    /// The state after a frame.
    pub fn state(&self) -> WatchState {
        // Fields left out are options, or filled anew for every frame.
        let Self {
            options: _,
            readout_s: _,
            filter,
            travel,
            samples: _,
            mirror,
            mirrored: _,
            compared_ns,
            pairs: _,
            log_likelihood: _,
            since_whole_s,
        } = self;
        WatchState {
            filter: filter.state(),
            travel: *travel,
            mirror: mirror.state(),
            compared_ns: *compared_ns,
            since_whole_s: *since_whole_s,
        }
    }

    /// As after the frame of a state.
    pub fn from_state(options: HeightOptions, readout_s: f64, state: WatchState) -> Self {
        let WatchState { filter, travel, mirror, compared_ns, since_whole_s } = state;
        Self {
            filter: HeightFilter::from_state(options, filter),
            travel,
            mirror: MirrorTest::from_state(options.mirror, mirror),
            compared_ns,
            since_whole_s,
            ..Self::new(options, readout_s)
        }
    }

    /// Forgets the height: a new segment has another unit. The direction of travel stays.
    pub fn reset(&mut self) {
        self.filter.reset();
        self.compared_ns = None;
    }

    /// The height, once it is known.
    pub fn estimate(&self) -> Option<HeightEstimate> {
        self.filter.estimate()
    }

    /// True while the road mirrors what stands above it: its pictures show a plane below it.
    pub fn mirrors(&self) -> bool {
        self.mirror.mirrors()
    }

    /// Unit normal away from the camera of the road by the direction of travel.
    pub fn down(&self) -> Option<Vector3<f64>> {
        self.travel.down()
    }

    /// True when a plane m agrees with the height, where it is known, and with the direction of travel.
    pub fn agrees(&self, m: &Vector3<f64>) -> bool {
        let near = self.filter.estimate().is_none_or(|known| {
            let sigma = known.sigma.hypot(self.options.least_sigma);
            (m.norm().ln() - known.log_inverse_height).abs() < self.options.gate * sigma
        });
        let [most_pitch, most_roll] = self.options.most_tilt_rad;
        let level = self.travel.direction().is_none_or(|travel| {
            let pitch = m.normalize().dot(&travel).asin();
            pitch.abs() < most_pitch && (m.x / m.y).atan().abs() < most_roll
        });
        near && level
    }

    /// Compares a frame with earlier ones; what it says of the height alone, once the height is known.
    pub fn process(
        &mut self,
        current: &WatchedFrame<'_>,
        history: &RoadHistory,
        pose_of: &impl Fn(usize) -> Option<Pose<Camera, World>>,
    ) -> Option<RoadMeasurement> {
        let motion_from = |earlier: &EarlierFrame| -> Option<Pose<Camera, Camera>> {
            Some(pose_of(earlier.frame)? * current.camera_from_world.inverse())
        };
        self.follow_travel(current, history, motion_from);
        self.look_for_a_mirror(current, history);
        let known = self.filter.estimate();
        let elapsed_s = self.compared_ns.map_or(0.0, |before| seconds(current.timestamp_ns - before));
        if known.is_some() && self.compared_ns.is_some() && elapsed_s < self.options.interval_s {
            return None;
        }
        let (travel, down) = self.travel.direction().zip(self.travel.down())?;
        self.find_pairs(history, known, motion_from);
        let nearest = history.newest(self.pairs.first()?.0)?;
        let pictures = (current.pyramid, &*nearest.pyramid);
        if self.mirrors() {
            let visible = |p: &Point2<f64>| !current.vehicles.iter().any(|v| v.contains(p.x, p.y));
            let road = |p: &Point2<f64>| current.road.contains(p);
            let view = mirror_view(current, &down, &self.options);
            let (options, scratch) = (&self.options.mirror, &mut self.mirror.scratch);
            view.pairs(road, visible, options, scratch, &mut self.mirrored);
            self.samples.collect_mirrored(current.camera, pictures, &self.mirrored, &self.options);
        } else {
            let directions = (&down, &travel);
            let usable = |p: &Point2<f64>| current.road.contains(p);
            let far_heights = current.far_heights;
            self.samples.collect(current.camera, pictures, directions, far_heights, usable, &self.options);
        }
        if !self.samples.enough(&self.options) {
            return None;
        }
        let first = self.compare(current, history, elapsed_s);
        self.compared_ns = Some(current.timestamp_ns);
        let measured = known.and_then(|known| self.filter.measure(first, &self.log_likelihood, &known));
        self.filter.add(first, &self.log_likelihood, (self.pairs.len(), elapsed_s));
        let (place, motion) = self.pairs.get(self.pairs.len() / 2)?;
        let (reference, baseline) = (history.newest(*place)?.frame, motion.translation().norm());
        measured.map(|m| self.measurement(&m, &down, (current.frame, reference, baseline)))
    }

    /// Tests whether the road mirrors. What was known of the height by a road that turns out to mirror is forgotten.
    fn look_for_a_mirror(&mut self, current: &WatchedFrame<'_>, history: &RoadHistory) {
        let Some(down) = self.travel.down() else { return };
        let before_ns = history.newest_ns().unwrap_or(current.timestamp_ns);
        let view = mirror_view(current, &down, &self.options);
        let before = self.mirror.mirrors();
        let road = |p: &Point2<f64>| current.road.contains(p);
        self.mirror.process(&view, road, seconds(current.timestamp_ns - before_ns));
        if self.mirror.mirrors() && !before {
            self.reset();
        }
    }

    /// Adds the motion since the frame before to the direction of travel.
    fn follow_travel(
        &mut self,
        current: &WatchedFrame<'_>,
        history: &RoadHistory,
        motion_from: impl Fn(&EarlierFrame) -> Option<Pose<Camera, Camera>>,
    ) {
        let Some(earlier) = history.newest(0) else { return };
        let Some(motion) = motion_from(earlier) else { return };
        if motion.translation().norm() > self.options.least_step_units {
            // The earlier camera's place in the current frame, turned round.
            let moved = -motion.inverse().translation();
            let elapsed_s = seconds(current.timestamp_ns - earlier.timestamp_ns);
            self.travel.add(&moved, elapsed_s, self.options.travel_s);
        }
    }

    /// Finds earlier frames at growing distances.
    fn find_pairs(
        &mut self,
        history: &RoadHistory,
        known: Option<HeightEstimate>,
        motion_from: impl Fn(&EarlierFrame) -> Option<Pose<Camera, Camera>>,
    ) {
        let options = &self.options;
        let height = known.map(|k| (-k.log_inverse_height).exp());
        let [least, most] = options.baseline_heights;
        let mut next = height.map_or(0.0, |h| least * h).max(options.least_baseline_units);
        let most = height.map_or(f64::INFINITY, |h| most * h);
        self.pairs.clear();
        for (place, earlier) in history.newest_first().enumerate() {
            let Some(motion) = motion_from(earlier) else { break };
            let baseline = motion.translation().norm();
            if baseline > most || self.pairs.len() == options.most_pairs {
                break;
            }
            if baseline >= next {
                next = baseline * options.baseline_factor;
                self.pairs.push((place, motion));
            }
        }
    }

    /// Log likelihoods by all pairs, from the returned cell of the filter on.
    fn compare(&mut self, current: &WatchedFrame<'_>, history: &RoadHistory, elapsed_s: f64) -> usize {
        self.since_whole_s += elapsed_s;
        let whole = self.filter.estimate().is_none() || self.since_whole_s >= self.options.whole_range_s;
        if whole {
            self.since_whole_s = 0.0;
        }
        let cells = self.filter.cells(whole);
        self.log_likelihood.clear();
        self.log_likelihood.resize(cells.len(), 0.0);
        for (place, motion) in &self.pairs {
            let Some(earlier) = history.newest(*place) else { continue };
            let heights = cells.clone().map(|k| self.filter.log_inverse_height(k));
            let road = if self.mirror.mirrors() { RoadPixels::everywhere() } else { &earlier.road };
            let reference = (&*earlier.pyramid, road);
            let out = &mut self.log_likelihood;
            let between_ns = current.timestamp_ns - earlier.timestamp_ns;
            let motion = (motion, row_share(self.readout_s, current.camera, between_ns));
            self.samples.add_log_likelihood(current.camera, reference, motion, heights, &self.options, out);
        }
        cells.start
    }

    fn measurement(
        &self,
        height: &HeightEstimate,
        down: &Vector3<f64>,
        (frame, reference, baseline): (usize, usize, f64),
    ) -> RoadMeasurement {
        let (value, _) = coordinates(&(down * height.log_inverse_height.exp()), 0.0);
        let [pitch, roll] = self.options.tilt_sigmas_rad;
        let by_tilt = if self.mirrors() { self.samples.sigma_by_tilt(pitch) } else { 0.0 };
        let sigmas = Vector3::new(height.sigma.hypot(by_tilt), pitch, roll);
        RoadMeasurement {
            frame,
            reference,
            state: RoadState::from_vector(&value.xyz()),
            baseline,
            covariance: Matrix3::from_diagonal(&sigmas.map(|s| s * s)),
            curvature: None,
            agreement: 1.0,
            pixels: self.samples.len(),
        }
    }
}

fn mirror_view<'a>(
    current: &WatchedFrame<'a>,
    down: &'a Vector3<f64>,
    options: &HeightOptions,
) -> MirrorView<'a> {
    MirrorView {
        camera: current.camera,
        pyramid: current.pyramid,
        down,
        far_heights: current.far_heights,
        half_width_heights: options.half_width_heights,
        level: options.level.min(current.pyramid.len() - 1),
    }
}
