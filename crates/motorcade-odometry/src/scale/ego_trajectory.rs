//! The metric trajectory of the camera and the road under it, from up-to-scale odometry and road measurements.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::smoother::{NoiseModel, SmoothedState, StateMeasurement, smooth};
use super::uncertainty::{Uncertainty, step_covariance};
use crate::road::{RoadMeasurement, road_normal};
use crate::trajectory::{FrameStatus, OdometryTrajectory};

/// A frame of the metric trajectory.
#[derive(Clone, Debug)]
pub struct EgoFrame {
    /// Pose \[m\]; the world is the camera of the first frame.
    pub world_from_camera: Pose<World, Camera>,
    /// How the pose was found.
    pub status: FrameStatus,
    /// False where the motion from the frame before was not measured but filled in: across a break, or before a map began.
    pub step_measured: bool,
    /// Covariance of the motion from the frame before (6×6 `[ω, ν]`, rad and m), in this camera's frame.
    pub step_covariance: Matrix6<f64>,
    /// Covariance of the pose in the world (6×6 `[ω, ν]`), accumulated from the first frame.
    pub covariance: Matrix6<f64>,
    /// Metres per unit of the odometry.
    pub scale: f64,
    /// Standard deviation of log scale.
    pub scale_sigma: f64,
    /// The part of it that `step_covariance` holds: what the frame errs by beside its neighbours.
    pub scale_sigma_alone: f64,
    /// Correlation of its error with that of the frame before.
    pub scale_correlation: f64,
    /// Standard deviation of an error of log scale that all frames share, besides.
    pub scale_bias_sigma: f64,
    /// True when a measurement of this frame itself entered; else the scale leans on neighbours.
    pub scale_measured: bool,
    /// Unit normal of the road towards the camera, camera frame.
    pub road_normal: Vector3<f64>,
    /// Covariance of pitch and roll of the road (2×2 in the upper left) \[rad²\].
    pub road_tilt_covariance: Matrix3<f64>,
    /// Landmarks that agreed on the pose.
    pub inliers: usize,
}

/// What the road's alignment errs by over a whole drive, as a share of all lengths: shadows that move, crowns of streets, a
/// camera whose height is known to a centimetre. Root mean square over the drives of the simulator, and about what two real
/// ones show.
const ROAD_BIAS: f64 = 0.006;

/// The metric trajectory of a drive.
#[derive(Clone, Debug)]
pub struct EgoTrajectory {
    /// One a frame.
    pub frames: Vec<EgoFrame>,
    /// Height of the camera above the road \[m\].
    pub height_m: f64,
    /// Noise of each segment, as the drive itself told it.
    pub noise: Vec<Option<NoiseModel>>,
}

impl EgoTrajectory {
    /// Puts metres into an odometry by the camera's height \[m\].
    ///
    /// All lengths are proportional to `height_m`, exactly. A segment without any road measurement goes on at the
    /// metric speed of the one before it.
    pub fn new(odometry: &OdometryTrajectory, measurements: &[RoadMeasurement], height_m: f64) -> Self {
        Self::build(odometry, measurements, height_m, smooth_segment, ROAD_BIAS)
    }

    /// As [`EgoTrajectory::new`], but each frame keeps the scale measured in it, as in the paper; frames without one take
    /// that of the frame before. The road is level and the camera looks along it.
    pub fn unsmoothed(
        odometry: &OdometryTrajectory,
        measurements: &[RoadMeasurement],
        height_m: f64,
    ) -> Self {
        Self::build(odometry, measurements, height_m, keep_segment, ROAD_BIAS)
    }

    /// As [`EgoTrajectory::new`] for an odometry that is metric already: only the road is taken from the measurements.
    pub fn metric(odometry: &OdometryTrajectory, measurements: &[RoadMeasurement], height_m: f64) -> Self {
        Self::metric_within(odometry, measurements, height_m, 0.0)
    }

    /// As [`EgoTrajectory::metric`] for one all of whose lengths may be off by a common share of this standard deviation.
    pub fn metric_within(
        odometry: &OdometryTrajectory,
        measurements: &[RoadMeasurement],
        height_m: f64,
        scale_bias_sigma: f64,
    ) -> Self {
        Self::build(odometry, measurements, height_m, metric_segment, scale_bias_sigma)
    }

    fn build(
        odometry: &OdometryTrajectory,
        measurements: &[RoadMeasurement],
        height_m: f64,
        fill: FillSegment,
        scale_bias_sigma: f64,
    ) -> Self {
        let steps = steps(odometry);
        let n = odometry.frames.len();
        let mut states: Vec<Option<SmoothedState>> = vec![None; n];
        let mut noise = Vec::new();
        for segment in 0..odometry.keyframes.len() {
            noise.push(fill(odometry, &steps, measurements, segment, height_m, &mut states));
        }
        let mut ego = Self { frames: Vec::with_capacity(n), height_m, noise };
        let scales = scales(&states, height_m);
        let metric = metric_steps(&steps, &scales);
        let mut uncertainty = Uncertainty::default();
        for k in 0..n {
            let step = (&metric[k], steps[k].is_some());
            let frame = ego.next_frame(odometry, k, step, scales[k], states[k].as_ref(), measurements);
            let frame = EgoFrame { scale_bias_sigma, ..frame };
            let covariance = uncertainty.advance(&frame, &metric[k]);
            ego.frames.push(EgoFrame { covariance, ..frame });
        }
        ego
    }

    /// Length of the way driven \[m\].
    pub fn length_m(&self) -> f64 {
        let step = |w: &[EgoFrame]| {
            (w[1].world_from_camera.translation() - w[0].world_from_camera.translation()).norm()
        };
        self.frames.windows(2).map(step).sum()
    }

    fn next_frame(
        &self,
        odometry: &OdometryTrajectory,
        k: usize,
        (metric_step, has_own): (&Pose<Camera, Camera>, bool),
        scale: f64,
        state: Option<&SmoothedState>,
        measurements: &[RoadMeasurement],
    ) -> EgoFrame {
        let record = &odometry.frames[k];
        // Where nobody saw the road, lengths may be off by a factor of two.
        const UNKNOWN: f64 = 0.5;
        let scale_sigma = state.map_or(UNKNOWN, |s| s.covariance[(0, 0)].max(0.0).sqrt());
        let world_from_camera =
            self.frames.last().map_or(Pose::identity(), |b| b.world_from_camera * *metric_step);
        // In the step alone the scale errs as if measurements were independent; how long its error lasts is told apart.
        let alone = scale_sigma / state.map_or(1.0, |s| s.overlap.sqrt());
        let step_measured =
            has_own && matches!(record.status, FrameStatus::Tracked | FrameStatus::Standstill);
        let step_covariance = step_covariance(metric_step, record.covariance, scale, alone, step_measured);
        let (pitch, roll) = state.map_or((0.0, 0.0), |s| (s.value.y, s.value.z));
        let mut road_tilt_covariance = Matrix3::zeros();
        match state {
            Some(s) => road_tilt_covariance
                .fixed_view_mut::<2, 2>(0, 0)
                .copy_from(&s.covariance.fixed_view::<2, 2>(1, 1)),
            // Nothing known of the road: a degree.
            None => road_tilt_covariance.fill_diagonal(1.0_f64.to_radians().powi(2)),
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
            scale_bias_sigma: 0.0,
            // In order of frames.
            scale_measured: measurements.binary_search_by_key(&k, |m| m.frame).is_ok(),
            road_normal: road_normal(pitch, roll),
            road_tilt_covariance,
            inliers: record.inliers,
        }
    }
}

/// Metres per unit of the odometry in each frame; where the road tells nothing, as in the frame before.
fn scales(states: &[Option<SmoothedState>], height_m: f64) -> Vec<f64> {
    let mut scale = height_m / 2.0;
    let one = |state: &Option<SmoothedState>| {
        scale = state.as_ref().map_or(scale, |s| s.value.x.exp());
        scale
    };
    states.iter().map(one).collect()
}

/// `camera_before_from_camera` of each frame in metres. Across a break, where frames have no step of their own, the motion
/// passes evenly from that before it to that after it.
fn metric_steps(steps: &[Option<Pose<Camera, Camera>>], scales: &[f64]) -> Vec<Pose<Camera, Camera>> {
    let own: Vec<Option<Vector6<f64>>> =
        steps.iter().zip(scales).map(|(s, scale)| s.map(|s| s.scaled(*scale).log())).collect();
    let (mut out, mut before): (Vec<Pose<Camera, Camera>>, Option<Vector6<f64>>) = (Vec::new(), None);
    while out.len() < own.len() {
        let k = out.len();
        if let (Some(twist), Some(step)) = (own[k], steps[k]) {
            before = Some(twist);
            out.push(step.scaled(scales[k]));
            continue;
        }
        let end = (k..own.len()).find(|e| own[*e].is_some()).unwrap_or(own.len());
        let after = own.get(end).copied().flatten();
        let (a, b) = (before.or(after), after.or(before));
        for i in k..end {
            let fraction = (i - k + 1) as f64 / (end - k + 1) as f64;
            let twist = a.zip(b).map_or_else(Vector6::zeros, |(a, b)| a.lerp(&b, fraction));
            // Nothing leads to the first frame of all.
            out.push(if i == 0 { Pose::identity() } else { Pose::exp(&twist) });
        }
    }
    out
}

/// `camera_before_from_camera` of each frame in its segment's unit; bridged frames share out the motion between their
/// neighbours. `None` at the first frame, at the start of a segment and where a segment ended bridged.
fn steps(odometry: &OdometryTrajectory) -> Vec<Option<Pose<Camera, Camera>>> {
    let n = odometry.frames.len();
    let mut poses: Vec<Option<Pose<Camera, World>>> = (0..n).map(|k| odometry.camera_from_world(k)).collect();
    let found = |k: usize| {
        odometry.frames[k].status != FrameStatus::Bridged && odometry.frames[k].segment != usize::MAX
    };
    let mut k = 1;
    while k < n {
        if found(k) {
            k += 1;
            continue;
        }
        let end = (k..n).find(|e| found(*e));
        let neighbours = end.filter(|e| odometry.frames[*e].segment == odometry.frames[k - 1].segment);
        match neighbours.and_then(|e| Some((e, poses[k - 1]?, poses[e]?))) {
            Some((e, a, b)) => {
                let whole: Pose<Camera, Camera> = (b * a.inverse()).cast();
                for i in k..e {
                    let fraction = (i - k + 1) as f64 / (e - k + 1) as f64;
                    poses[i] = Some(
                        Pose::<Camera, Camera>::exp(&(whole.log() * fraction)).cast::<Camera, Camera>() * a,
                    );
                }
            }
            None => (k..end.unwrap_or(n)).for_each(|i| poses[i] = None),
        }
        k = end.unwrap_or(n);
    }
    let step = |k: usize| {
        let same = k > 0 && odometry.frames[k].segment == odometry.frames[k - 1].segment;
        same.then(|| Some((poses[k - 1]? * poses[k]?.inverse()).cast())).flatten()
    };
    (0..n).map(step).collect()
}

/// Fills in the states of a segment's frames.
type FillSegment = fn(
    &OdometryTrajectory,
    &[Option<Pose<Camera, Camera>>],
    &[RoadMeasurement],
    usize,
    f64,
    &mut [Option<SmoothedState>],
) -> Option<NoiseModel>;

fn metric_segment(
    odometry: &OdometryTrajectory,
    steps: &[Option<Pose<Camera, Camera>>],
    measurements: &[RoadMeasurement],
    segment: usize,
    height_m: f64,
    states: &mut [Option<SmoothedState>],
) -> Option<NoiseModel> {
    let model = smooth_segment(odometry, steps, measurements, segment, height_m, states);
    let own = |(k, _): &(usize, &mut Option<SmoothedState>)| odometry.frames[*k].segment == segment;
    for (_, state) in states.iter_mut().enumerate().filter(own) {
        // Half a degree of pitch and roll where nobody saw the road: a camera mounted level.
        let level = Matrix3::from_diagonal(&Vector3::new(1e-4, 7.6e-5, 7.6e-5));
        let mut own = state.unwrap_or(SmoothedState {
            value: Vector3::zeros(),
            covariance: level,
            correlation: 0.0,
            overlap: 1.0,
        });
        own.value.x = 0.0;
        own.covariance[(0, 0)] = 1e-4;
        *state = Some(own);
    }
    model
}

fn keep_segment(
    odometry: &OdometryTrajectory,
    _steps: &[Option<Pose<Camera, Camera>>],
    measurements: &[RoadMeasurement],
    segment: usize,
    height_m: f64,
    states: &mut [Option<SmoothedState>],
) -> Option<NoiseModel> {
    let read = |m: &RoadMeasurement| m.read_by(odometry);
    let of = |m: &RoadMeasurement| SmoothedState {
        value: read(m).value + Vector3::new(height_m.ln(), 0.0, 0.0),
        covariance: read(m).covariance,
        // Each frame stands alone.
        correlation: 0.0,
        overlap: 1.0,
    };
    let mut own = measurements.iter().filter(|m| odometry.frames[m.frame].segment == segment).peekable();
    let mut present = own.peek().map(|m| of(m))?;
    for (k, state) in states.iter_mut().enumerate() {
        while let Some(m) = own.next_if(|m| m.frame <= k) {
            present = of(m);
        }
        if odometry.frames[k].segment == segment {
            *state = Some(present);
        }
    }
    None
}

fn smooth_segment(
    odometry: &OdometryTrajectory,
    steps: &[Option<Pose<Camera, Camera>>],
    measurements: &[RoadMeasurement],
    segment: usize,
    height_m: f64,
    states: &mut [Option<SmoothedState>],
) -> Option<NoiseModel> {
    let frames: Vec<usize> = (0..steps.len()).filter(|k| odometry.frames[*k].segment == segment).collect();
    let (first, last) = (*frames.first()?, *frames.last()?);
    let own: Vec<StateMeasurement> = measurements
        .iter()
        .filter(|m| (first..=last).contains(&m.frame))
        .map(|m| {
            // The scale belongs to the motion between the two frames; its middle is where it is put.
            let middle = (m.frame + m.reference).div_ceil(2).max(first);
            let reading = m.read_by(odometry);
            StateMeasurement {
                frame: middle.max(m.frame.min(middle)) - first,
                value: reading.value + Vector3::new(height_m.ln(), 0.0, 0.0),
                covariance: reading.covariance,
            }
        })
        .collect();
    let mut scales: Vec<f64> = own.iter().map(|m| m.value.x).collect();
    let typical = motorcade_geometry::robust::median(&mut scales)?.exp();
    let travelled: Vec<f64> = (first..=last)
        .map(|k| steps[k].map_or(0.0, |s| s.translation().norm() * typical / height_m))
        .collect();
    let (smoothed, model) = smooth(&travelled, &own)?;
    for (k, state) in (first..=last).zip(smoothed) {
        states[k] = Some(state);
    }
    Some(model)
}
