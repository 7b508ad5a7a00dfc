//! The metric trajectory of the camera and the road under it, from up-to-scale odometry and road measurements.

use motorcade_geometry::{Camera, Pose, lie::se3::adjoint};
use nalgebra::{Matrix3, Matrix6};

use super::ego_frame::EgoFrame;
use super::options::MetricOptions;
use super::scale_measurement::ScaleMeasurement;
use super::segment_states::{Drive, Gap, Method};
use super::state::{NoiseModel, OF_LOG_SCALE, SmoothedState};
use super::steps::{metric_steps, unit_steps};
use super::uncertainty::{Uncertainty, add_unseen_motion, step_covariance};
use crate::road::{RoadMeasurement, road_normal};
use crate::time::{calibrated, seconds};
use crate::trajectory::{FrameRecord, FrameStatus, OdometryTrajectory};

/// The metric trajectory of a drive.
#[derive(Clone, Debug)]
pub struct EgoTrajectory {
    /// One per frame.
    pub frames: Vec<EgoFrame>,
    /// Height of the camera above the road \[m\].
    pub height_m: f64,
    /// Noise of each segment, estimated from the drive.
    pub noise: Vec<Option<NoiseModel>>,
}

impl EgoTrajectory {
    /// Metric trajectory of an odometry by the camera's height \[m\].
    ///
    /// All lengths are proportional to `height_m`, exactly. A segment without any road measurement continues at the
    /// metric speed of the one before it. `measurements` are in order of frames.
    pub fn new(
        odometry: &OdometryTrajectory,
        measurements: &[RoadMeasurement],
        height_m: f64,
        options: &MetricOptions,
    ) -> Self {
        Self::build(odometry, (measurements, &[]), height_m, options, Method::Smoothed)
    }

    /// As [`EgoTrajectory::new`], with scales that another sensor measures where the road does not.
    pub fn with_distances(
        odometry: &OdometryTrajectory,
        measurements: &[RoadMeasurement],
        distances: &[ScaleMeasurement],
        height_m: f64,
        options: &MetricOptions,
    ) -> Self {
        Self::build(odometry, (measurements, distances), height_m, options, Method::Smoothed)
    }

    /// As [`EgoTrajectory::new`], but each frame keeps the scale measured in it, as in the paper; frames without one take
    /// that of the frame before. The road is level and the camera looks along it.
    pub fn unsmoothed(
        odometry: &OdometryTrajectory,
        measurements: &[RoadMeasurement],
        height_m: f64,
        options: &MetricOptions,
    ) -> Self {
        Self::build(odometry, (measurements, &[]), height_m, options, Method::PerFrame)
    }

    /// As [`EgoTrajectory::new`] for an odometry that is metric already: only the road is taken from the measurements.
    /// `scale_bias_sigma` is the standard deviation of an error of log scale that all its lengths share.
    pub fn metric(
        odometry: &OdometryTrajectory,
        measurements: &[RoadMeasurement],
        height_m: f64,
        scale_bias_sigma: f64,
        options: &MetricOptions,
    ) -> Self {
        let options = MetricOptions { bias_sigma: scale_bias_sigma, ..*options };
        Self::build(odometry, (measurements, &[]), height_m, &options, Method::Metric)
    }

    fn build(
        odometry: &OdometryTrajectory,
        (measurements, distances): (&[RoadMeasurement], &[ScaleMeasurement]),
        height_m: f64,
        options: &MetricOptions,
        method: Method,
    ) -> Self {
        let steps = unit_steps(odometry);
        let motion_is_known = steps.iter().any(Option::is_some);
        let drive =
            Drive { odometry, steps: &steps, motion_is_known, measurements, distances, height_m, options };
        let mut states: Vec<Option<SmoothedState>> = vec![None; odometry.frames.len()];
        let segments = 0..odometry.keyframes.len();
        let noise = segments.map(|segment| drive.fill(method, segment, &mut states)).collect();
        let scales = scales(&states, height_m / options.guess_units);
        let metric = metric_steps(odometry.frames.kept(), &steps, &scales);
        let mut ego = Self { frames: Vec::with_capacity(states.len()), height_m, noise };
        let mut uncertainty = Uncertainty::default();
        let gaps = drive.gaps();
        for (k, state) in states.iter().enumerate() {
            let frame = ego.next_frame(&drive, (k, gaps[k]), &metric[k], scales[k], state.as_ref());
            let covariance = uncertainty.advance(&frame, &metric[k]);
            ego.frames.push(EgoFrame { covariance, ..frame });
        }
        ego
    }

    /// The frames `rows` alone, in order; the step to each goes from the one before it in `rows`.
    pub fn of_rows(&self, rows: &[usize]) -> Self {
        let mut frames: Vec<EgoFrame> = Vec::with_capacity(rows.len());
        let mut before = None;
        for &row in rows {
            let mut frame = self.frames[row].clone();
            for passed in before.map_or(row, |b: usize| b + 1)..row {
                // The covariance of a step is that of its end, in the frame of its end.
                let on = frame.world_from_camera.inverse() * self.frames[passed].world_from_camera;
                let transport = adjoint(on.isometry());
                frame.step_covariance +=
                    transport * self.frames[passed].step_covariance * transport.transpose();
                frame.step_measured &= self.frames[passed].step_measured;
            }
            before = Some(row);
            frames.push(frame);
        }
        Self { frames, height_m: self.height_m, noise: self.noise.clone() }
    }

    /// Length of the trajectory \[m\].
    pub fn length_m(&self) -> f64 {
        let step = |w: &[EgoFrame]| {
            (w[1].world_from_camera.translation() - w[0].world_from_camera.translation()).norm()
        };
        self.frames.windows(2).map(step).sum()
    }

    /// Frame `k`, which lies in `gap` between two frames with a measured pose.
    fn next_frame(
        &self,
        drive: &Drive<'_>,
        (k, gap): (usize, Option<Gap>),
        metric_step: &Pose<Camera, Camera>,
        scale: f64,
        state: Option<&SmoothedState>,
    ) -> EgoFrame {
        let (options, frames) = (drive.options, &drive.odometry.frames);
        let record = &frames[k];
        let scale_sigma =
            state.map_or(options.unknown_scale_sigma, |s| s.covariance[OF_LOG_SCALE].max(0.0).sqrt());
        let world_from_camera =
            self.frames.last().map_or(Pose::identity(), |b| b.world_from_camera * *metric_step);
        // The part of the error that is independent from frame to frame.
        let alone = scale_sigma / state.map_or(1.0, |s| s.overlap.sqrt());
        let step_measured = drive.is_measured(k);
        let before = k.checked_sub(1).map_or(record, |b| &frames[b]);
        let elapsed = if k == 0 { 1.0 } else { calibrated(record.timestamp_ns - before.timestamp_ns) };
        let unmeasured = (!step_measured).then_some(elapsed);
        let mut step_covariance =
            step_covariance(metric_step, record.covariance, (scale, alone), unmeasured, options);
        if let Some(gap) = gap.filter(|_| k > 0 && record.status != FrameStatus::Bridged) {
            // A map ended, and none is there yet; the step to the first frame of the next is unseen too.
            let times_ns = [before.timestamp_ns, record.timestamp_ns];
            add_unseen_motion(&mut step_covariance, &gap, times_ns, options);
        }
        if unmeasured.is_some() && !drive.motion_is_known && record.status != FrameStatus::Standstill {
            // One speed for all frames so far: its error grows with the time, not with the root of it.
            let since_s = |at: &FrameRecord| seconds(at.timestamp_ns - frames[0].timestamp_ns);
            let squares = since_s(record).powi(2) - since_s(before).powi(2);
            step_covariance[(5, 5)] += options.unknown_speed_sigma_mps.powi(2) * squares.max(0.0);
        }
        let (pitch_rad, roll_rad) = state.map_or((0.0, 0.0), |s| (s.value.pitch_rad, s.value.roll_rad));
        let mut road_tilt_covariance = Matrix3::zeros();
        match state {
            Some(s) => road_tilt_covariance
                .fixed_view_mut::<2, 2>(0, 0)
                .copy_from(&s.covariance.fixed_view::<2, 2>(1, 1)),
            None => road_tilt_covariance.fill_diagonal(options.unknown_tilt_sigma_rad.powi(2)),
        }
        EgoFrame {
            world_from_camera,
            status: record.status,
            step_measured,
            step_covariance,
            covariance: Matrix6::zeros(),
            scale,
            scale_sigma,
            scale_sigma_alone: alone,
            scale_correlation: state.map_or(0.0, |s| s.correlation),
            scale_bias_sigma: options.bias_sigma,
            scale_measured: drive.measurements.binary_search_by_key(&k, |m| m.frame).is_ok(),
            road_normal: road_normal(pitch_rad, roll_rad),
            road_tilt_covariance,
            inliers: record.inliers,
        }
    }
}

/// Metres per unit of the odometry in each frame; without a state as in the frame before, at first `initial`.
fn scales(states: &[Option<SmoothedState>], initial: f64) -> Vec<f64> {
    let mut scale = initial;
    let next = |state: &Option<SmoothedState>| {
        scale = state.as_ref().map_or(scale, |s| s.value.log_scale.exp());
        scale
    };
    states.iter().map(next).collect()
}
