//! Metres by distances that another sensor measured, beside the camera's height.
//!
//! By the road alone all lengths have one factor in common, the error of the height. The median ratio of the sensor's distances to the
//! estimated ones gives it; factor and height are combined by their variances. Where the road was not measured each distance also
//! gives the scale of the odometry at its time.

use motorcade_geometry::robust::median;
use motorcade_odometry::{EgoTrajectory, OdometryTrajectory, RoadMeasurement, ScaleMeasurement};
use nalgebra::Vector3;

use crate::config::Config;
use crate::distances::{DistanceSensor, Distances};
use crate::estimator_options::DistanceOptions;

/// Rounds of reweighting.
const ROUNDS: usize = 20;

/// Results of the distances of another sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DistanceFit {
    pub(crate) sensor: DistanceSensor,
    /// Logarithm of true over estimated lengths, by the sensor alone.
    pub(crate) log_factor: f64,
    /// Its standard deviation.
    pub(crate) sigma: f64,
    /// Standard deviation of the same by the height alone.
    pub(crate) height_sigma: f64,
    /// Height with which lengths were estimated \[m\].
    pub(crate) stated_m: f64,
    /// Height by both \[m\].
    pub(crate) height_m: f64,
    /// Relative standard deviation of all lengths in common.
    pub(crate) common_sigma: f64,
    /// Offset from the clock of the frames to that of the sensor \[s\].
    pub(crate) clock_offset_s: f64,
    /// Distances that were compared.
    pub(crate) count: usize,
    /// True where no road was measured: the sensor alone gives lengths.
    pub(crate) alone: bool,
}

/// The trajectory in metres by the road, the camera's height and the distances. `None` where no distance lies in the drive.
pub(crate) fn ego(
    odometry: &OdometryTrajectory,
    measurements: &[RoadMeasurement],
    height_m: f64,
    distances: &Distances,
    config: &Config,
) -> Option<(EgoTrajectory, DistanceFit)> {
    let (metric, options) = (&config.scale.advanced.metric, &config.scale.distances);
    let by_road = EgoTrajectory::new(odometry, measurements, height_m, metric);
    let way = Way::new(odometry, &by_road);
    let (clock_offset_s, ratios) = way.ratios_at_best_offset(distances, options);
    let (log_factor, spread) = robust_mean(&ratios, options)?;
    let own_sigma = match distances.sensor {
        DistanceSensor::Speed => options.speed_sigma,
        DistanceSensor::Gps => options.gps_sigma,
    };
    let alone = measurements.is_empty();
    let mut fit = DistanceFit {
        sensor: distances.sensor,
        log_factor,
        sigma: spread.hypot(own_sigma),
        height_sigma: metric.bias_sigma,
        stated_m: height_m,
        height_m,
        common_sigma: own_sigma,
        clock_offset_s,
        count: ratios.len(),
        alone,
    };
    // Without a road the scales are the sensor's.
    let correction = if alone { log_factor } else { fit.combine(options) };
    let shift = if alone { 0.0 } else { correction - log_factor };
    let scale = |ratio: &Ratio| ScaleMeasurement {
        frame: ratio.middle,
        log_scale: by_road.frames[ratio.middle].scale.ln() + ratio.log + shift,
        variance: ratio.own_sigma.powi(2),
    };
    let scales: Vec<ScaleMeasurement> = ratios.iter().map(scale).collect();
    let metric = motorcade_odometry::MetricOptions { bias_sigma: fit.common_sigma, ..*metric };
    let ego = EgoTrajectory::with_distances(odometry, measurements, &scales, fit.height_m, &metric);
    Some((ego, fit))
}

impl DistanceFit {
    /// Combines height and distances; returns the logarithm of the factor on all lengths. Where both disagree beyond their standard
    /// deviations one of them is wrong, and the standard deviation is half of what they are apart.
    fn combine(&mut self, options: &DistanceOptions) -> f64 {
        let (height, sensor) = (self.height_sigma.powi(-2), self.sigma.powi(-2));
        let correction = sensor * self.log_factor / (height + sensor);
        let combined = (height + sensor).powf(-0.5);
        self.height_m = self.stated_m * correction.exp();
        self.common_sigma =
            if self.disagrees(options) { combined.max(0.5 * self.log_factor.abs()) } else { combined };
        correction
    }

    fn disagrees(&self, options: &DistanceOptions) -> bool {
        self.log_factor.abs() > options.advanced.disagreement_sigmas * self.height_sigma.hypot(self.sigma)
    }

    /// Messages to the user.
    pub(crate) fn describe(&self, options: &DistanceOptions) -> String {
        let Self { sensor, count, clock_offset_s, stated_m, .. } = *self;
        let percent = 100.0 * if self.alone { self.sigma } else { self.common_sigma };
        let clock = format!("{count} distances of the {sensor}, clock offset {clock_offset_s:+.2} s");
        if self.alone {
            return format!("no road was seen: metres by {clock}, ± {percent:.1} %");
        }
        let said = stated_m * self.log_factor.exp();
        if self.disagrees(options) {
            return format!(
                "the height {stated_m:.2} m disagrees with the {sensor}, by which it is {said:.2} ± {:.2} m ({clock}); lengths are taken \
                 for right to {percent:.1} %",
                said * self.sigma
            );
        }
        let (height_m, sigma_m) = (self.height_m, self.height_m * self.common_sigma);
        format!("height of the camera with {clock}: {height_m:.2} ± {sigma_m:.2} m")
    }
}

/// A distance of the sensor over the one that was estimated.
#[derive(Clone, Copy, Debug)]
struct Ratio {
    /// Frame in the middle.
    middle: usize,
    /// Logarithm of the ratio.
    log: f64,
    /// Standard deviation by the sensor alone.
    own_sigma: f64,
    /// Standard deviation with that of the estimated length.
    sigma: f64,
}

/// The way of the camera over time.
struct Way {
    times_s: Vec<f64>,
    /// Length from the first frame \[m\].
    metres: Vec<f64>,
    positions: Vec<Vector3<f64>>,
    /// Direction of view in the world.
    views: Vec<Vector3<f64>>,
    /// Frames without a measured step, up to each.
    unmeasured: Vec<usize>,
    scale_sigmas: Vec<f64>,
}

impl Way {
    fn new(odometry: &OdometryTrajectory, ego: &EgoTrajectory) -> Self {
        let (mut metres, mut unmeasured) = (vec![0.0], vec![0]);
        for pair in ego.frames.windows(2) {
            let step = pair[1].world_from_camera.translation() - pair[0].world_from_camera.translation();
            metres.push(metres.last().unwrap_or(&0.0) + step.norm());
            unmeasured.push(unmeasured.last().unwrap_or(&0) + usize::from(!pair[1].step_measured));
        }
        let frames = ego.frames.iter();
        Self {
            times_s: odometry.frames.iter().map(|f| f.timestamp_ns as f64 * 1e-9).collect(),
            metres,
            positions: frames.clone().map(|f| f.world_from_camera.translation()).collect(),
            views: frames.clone().map(|f| f.world_from_camera.transform_vector(&Vector3::z())).collect(),
            unmeasured,
            scale_sigmas: frames.map(|f| f.scale_sigma).collect(),
        }
    }

    /// The clock offset at which the ratios spread least for what is known of it, and the ratios there.
    fn ratios_at_best_offset(&self, distances: &Distances, options: &DistanceOptions) -> (f64, Vec<Ratio>) {
        let clock = distances.clock_offset(options);
        let step_s = options.advanced.clock_step_s;
        let most = (3.0 * clock.sigma_s / step_s).ceil().min(2000.0) as i64;
        let cost = |offset_s: f64| {
            let ratios = self.ratios(distances, offset_s, options);
            let mut logs: Vec<f64> = ratios.iter().map(|r| r.log).collect();
            let centre = median(&mut logs)?;
            // Mean instead of sum: another number of distances lies in the drive at another offset.
            let misfit = |r: &Ratio| (1.0 + ((r.log - centre) / r.sigma).powi(2)).ln();
            let mean = ratios.iter().map(misfit).sum::<f64>() / ratios.len() as f64;
            let expected = distances.measured.len().min(ratios.len()) as f64;
            Some(mean * expected + ((offset_s - clock.offset_s) / clock.sigma_s).powi(2))
        };
        let offsets = (-most..=most).map(|k| clock.offset_s + step_s * k as f64);
        let costs = offsets.filter_map(|offset| Some((offset, cost(offset)?)));
        let best = costs.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(clock.offset_s, |best| best.0);
        (best, self.ratios(distances, best, options))
    }

    fn ratios(&self, distances: &Distances, offset_s: f64, options: &DistanceOptions) -> Vec<Ratio> {
        let one = |d: &motorcade_dataset::MeasuredDistance| {
            let (a, b) = (self.at(d.from_s - offset_s)?, self.at(d.to_s - offset_s)?);
            let (first, last) = (a.0, (b.0 + 1).min(self.metres.len() - 1));
            let measured = self.unmeasured[last] == self.unmeasured[first];
            let length = if d.straight {
                (self.position(b) - self.position(a)).norm()
            } else {
                self.metre(b) - self.metre(a)
            };
            if !measured || length < options.advanced.least_m || d.metres < options.advanced.least_m {
                return None;
            }
            // An antenna or an axle that is elsewhere in the car moves otherwise in a bend.
            let turn = self.views[first].angle(&self.views[last]);
            let sigma_m = if d.straight { d.sigma_m.hypot(options.lever_m * turn) } else { d.sigma_m };
            let middle = (first + last) / 2;
            let own_sigma = sigma_m / d.metres;
            let sigma = own_sigma.hypot(self.scale_sigmas[middle]);
            Some(Ratio { middle, log: (d.metres / length).ln(), own_sigma, sigma })
        };
        distances.measured.iter().filter_map(one).collect()
    }

    /// Frame before a time and the part of the interval after it; `None` outside of the drive.
    fn at(&self, time_s: f64) -> Option<(usize, f64)> {
        let after = self.times_s.partition_point(|t| *t <= time_s);
        let before = after.checked_sub(1)?;
        match self.times_s.get(after) {
            Some(next) => Some((before, (time_s - self.times_s[before]) / (next - self.times_s[before]))),
            None => (time_s - self.times_s[before] < 1e-6).then_some((before, 0.0)),
        }
    }

    fn metre(&self, (k, part): (usize, f64)) -> f64 {
        let next = self.metres[(k + 1).min(self.metres.len() - 1)];
        self.metres[k] + part * (next - self.metres[k])
    }

    fn position(&self, (k, part): (usize, f64)) -> Vector3<f64> {
        let next = self.positions[(k + 1).min(self.positions.len() - 1)];
        self.positions[k].lerp(&next, part)
    }
}

/// Mean of the logarithms with Cauchy weights from the median on, and its standard deviation.
fn robust_mean(ratios: &[Ratio], options: &DistanceOptions) -> Option<(f64, f64)> {
    let mut logs: Vec<f64> = ratios.iter().map(|r| r.log).collect();
    let mut mean = median(&mut logs)?;
    let mut information = 0.0;
    for _ in 0..ROUNDS {
        let weight = |r: &Ratio| {
            let off = (r.log - mean) / (options.advanced.kernel_sigmas * r.sigma);
            1.0 / (r.sigma.powi(2) * (1.0 + off * off))
        };
        information = ratios.iter().map(weight).sum();
        mean = ratios.iter().map(|r| weight(r) * r.log).sum::<f64>() / information;
    }
    Some((mean, information.powf(-0.5)))
}
