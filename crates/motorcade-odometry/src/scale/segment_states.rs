//! Scale and tilt in every frame of a segment.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use motorcade_geometry::{Camera, Pose, robust::median};
use nalgebra::{Matrix3, Vector3};

use super::options::MetricOptions;
use super::scale_measurement::ScaleMeasurement;
use super::smoother::smooth;
use super::state::{Interval, NoiseModel, OF_LOG_SCALE, ScaleAndTilt, SmoothedState, StateMeasurement};
use crate::road::{RoadEstimate, RoadMeasurement, RoadState};
use crate::time::calibrated;
use crate::trajectory::OdometryTrajectory;

/// Method that turns measurements into states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    /// Smoothed over time.
    Smoothed,
    /// Each frame keeps the scale measured in it, as in the paper; frames without one take that of the frame before.
    PerFrame,
    /// The odometry is metric: only the tilt is smoothed.
    Metric,
}

/// Odometry and measurements of a drive.
#[derive(Clone, Copy)]
pub(super) struct Drive<'a> {
    pub odometry: &'a OdometryTrajectory,
    /// Steps in the odometry's unit.
    pub steps: &'a [Option<Pose<Camera, Camera>>],
    /// True when the step to any frame was measured.
    pub motion_is_known: bool,
    pub measurements: &'a [RoadMeasurement],
    pub distances: &'a [ScaleMeasurement],
    pub height_m: f64,
    pub options: &'a MetricOptions,
}

/// Frames without a measured pose between two with one, or at the end.
#[derive(Clone, Copy)]
pub(super) struct Gap {
    /// Time of the last measured pose before them \[ns\].
    pub before_ns: i64,
    /// Time of the last of them \[ns\].
    pub last_ns: i64,
    /// True when a measured pose follows.
    pub closed: bool,
}

impl Drive<'_> {
    /// True for a frame to which the step was measured.
    pub fn is_measured(&self, k: usize) -> bool {
        self.steps[k].is_some() && self.odometry.frames[k].is_measured()
    }

    /// The gap of each frame; none before the first measured pose.
    pub fn gaps(&self) -> Vec<Option<Gap>> {
        let frames = self.odometry.frames.kept();
        let mut out = vec![None; frames.len()];
        // To the first frame there is no step.
        let measured = |k: usize| if k == 0 { frames[0].is_measured() } else { self.is_measured(k) };
        let (mut before_ns, mut first) = (self.odometry.measured_before_ns, 0);
        for (k, frame) in frames.iter().enumerate() {
            if measured(k) {
                (before_ns, first) = (Some(frame.timestamp_ns), k + 1);
            } else if k + 1 == frames.len() || measured(k + 1) {
                let (last_ns, closed) = (frame.timestamp_ns, k + 1 < frames.len());
                out[first..=k].fill(before_ns.map(|before_ns| Gap { before_ns, last_ns, closed }));
            }
        }
        out
    }

    /// Fills in the states of the frames of a segment; returns the noise if it was estimated.
    pub fn fill(
        &self,
        method: Method,
        segment: usize,
        states: &mut [Option<SmoothedState>],
    ) -> Option<NoiseModel> {
        match method {
            Method::Smoothed => self.fill_smoothed(segment, states),
            Method::PerFrame => {
                self.fill_per_frame(segment, states);
                None
            }
            Method::Metric => {
                let model = self.fill_smoothed(segment, states);
                self.fix_scale(segment, states);
                model
            }
        }
    }

    /// Log of metres per unit, eq. (5), and tilt by a measurement.
    fn value(&self, estimate: &RoadEstimate) -> ScaleAndTilt {
        let RoadState { log_inverse_height, pitch_rad, roll_rad } = estimate.state;
        ScaleAndTilt { log_scale: log_inverse_height + self.height_m.ln(), pitch_rad, roll_rad }
    }

    fn fill_smoothed(&self, segment: usize, states: &mut [Option<SmoothedState>]) -> Option<NoiseModel> {
        let records = &self.odometry.frames;
        let frames: Vec<usize> = (0..self.steps.len()).filter(|k| records[*k].segment == segment).collect();
        let (first, last) = (*frames.first()?, *frames.last()?);
        let state = |m: &RoadMeasurement| {
            // The scale belongs to the motion between the two frames, and so to the middle between them.
            let middle = (m.frame + m.reference).div_ceil(2).max(first);
            let estimate = m.corrected(self.odometry, &self.options.profile);
            StateMeasurement {
                frame: middle - first,
                value: self.value(&estimate),
                covariance: estimate.covariance,
                of_road: true,
            }
        };
        let own = self.measurements.iter().filter(|m| (first..=last).contains(&m.frame));
        let mut own: Vec<StateMeasurement> = own.map(state).collect();
        own.extend(self.other_measurements(first..=last, &own));
        let mut scales: Vec<f64> = own.iter().map(|m| m.value.log_scale).collect();
        let typical = median(&mut scales)?.exp();
        let interval = |k: usize| Interval {
            travelled: self.steps[k].map_or(0.0, |s| s.translation().norm() * typical / self.height_m),
            elapsed: match k {
                0 => 1.0,
                _ => calibrated(records[k].timestamp_ns - records[k - 1].timestamp_ns),
            },
        };
        let intervals: Vec<Interval> = (first..=last).map(interval).collect();
        let (smoothed, model) =
            smooth(&intervals, &own, self.options.unknown_tilt_sigma_rad, &self.options.smoother)?;
        for (k, state) in (first..=last).zip(smoothed) {
            states[k] = Some(state);
        }
        Some(model)
    }

    /// Distances by other sensors, at frames whose scale the road does not measure: it measures it better.
    fn other_measurements(
        &self,
        frames: RangeInclusive<usize>,
        road: &[StateMeasurement],
    ) -> Vec<StateMeasurement> {
        let measured: BTreeSet<usize> = road.iter().map(|m| m.frame).collect();
        let own = self.distances.iter().filter(|m| frames.contains(&m.frame));
        let own = own.map(|m| StateMeasurement::of_scale(m.frame - frames.start(), m.log_scale, m.variance));
        own.filter(|m| !measured.contains(&m.frame)).collect()
    }

    fn fill_per_frame(&self, segment: usize, states: &mut [Option<SmoothedState>]) {
        let in_segment = |k: usize| self.odometry.frames[k].segment == segment;
        let state = |m: &RoadMeasurement| {
            let estimate = m.corrected(self.odometry, &self.options.profile);
            let value = self.value(&estimate);
            SmoothedState { value, covariance: estimate.covariance, correlation: 0.0, overlap: 1.0 }
        };
        let mut own = self.measurements.iter().filter(|m| in_segment(m.frame)).peekable();
        let Some(mut present) = own.peek().map(|m| state(m)) else { return };
        for (k, slot) in states.iter_mut().enumerate() {
            while let Some(m) = own.next_if(|m| m.frame <= k) {
                present = state(m);
            }
            if in_segment(k) {
                *slot = Some(present);
            }
        }
    }

    /// Scale 1 in every frame, and a level road where none was measured.
    fn fix_scale(&self, segment: usize, states: &mut [Option<SmoothedState>]) {
        let (scale, tilt) = (self.options.metric_variance, self.options.mounting_variance_rad2);
        let level = SmoothedState {
            value: ScaleAndTilt::default(),
            covariance: Matrix3::from_diagonal(&Vector3::new(scale, tilt, tilt)),
            correlation: 0.0,
            overlap: 1.0,
        };
        for (record, slot) in self.odometry.frames.iter().zip(states) {
            if record.segment == segment {
                let mut state = slot.unwrap_or(level);
                state.value.log_scale = 0.0;
                state.covariance[OF_LOG_SCALE] = scale;
                *slot = Some(state);
            }
        }
    }
}
