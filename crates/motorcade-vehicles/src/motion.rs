//! A vehicle's way over the road: constant-velocity smoothing in the world, and whether it moves at all.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// A measured place.
#[derive(Clone, Copy, Debug)]
pub struct PositionMeasurement {
    /// Frame (row of the run).
    pub frame: usize,
    /// Time \[s\].
    pub time_s: f64,
    /// Position in the world \[m\].
    pub position: Vector3<f64>,
    /// Covariance (3×3) \[m²\].
    pub covariance: Matrix3<f64>,
    /// Distance from the camera \[m\].
    pub range_m: f64,
}

/// A smoothed state.
#[derive(Clone, Copy, Debug)]
pub struct KinematicState {
    /// Position in the world \[m\].
    pub position: Vector3<f64>,
    /// Velocity in the world \[m/s\].
    pub velocity: Vector3<f64>,
    /// Covariance of both (6×6).
    pub covariance: Matrix6<f64>,
}

/// White-noise acceleration of a vehicle along the road plane \[m/s² per √Hz\]: gentle braking and bends.
const ACCELERATION: f64 = 1.2;
/// The same across the road plane: the road's own undulation.
const HEAVE: f64 = 0.3;

/// Smooths places (in order of time) with a white-noise-acceleration model; `times` are where the state is wanted, and
/// must include the places' times. `up` is the road normal in the world.
pub fn smooth_motion(
    places: &[PositionMeasurement],
    times: &[f64],
    up: &Vector3<f64>,
) -> Vec<KinematicState> {
    let Some(first) = places.first() else { return Vec::new() };
    let mut filter = MotionFilter::new(&first.position, &(first.covariance * 4.0));
    let (mut filtered, mut time, mut next) =
        (Vec::with_capacity(times.len()), times.first().copied().unwrap_or(0.0), 0);
    for t in times {
        let f = filter.predict(t - time, up);
        let predicted = (filter.x, filter.p, f);
        while let Some(place) = places.get(next).filter(|m| m.time_s <= t + 1e-9) {
            filter.update(&place.position, &place.covariance);
            next += 1;
        }
        filtered.push((predicted, (filter.x, filter.p)));
        time = *t;
    }
    let mut out: Vec<KinematicState> = Vec::with_capacity(times.len());
    for k in (0..filtered.len()).rev() {
        let (mut x, mut p) = filtered[k].1;
        if let (Some(ahead), Some((predicted, _))) = (out.last(), filtered.get(k + 1))
            && let Some(inverse) = predicted.1.try_inverse()
        {
            let gain = p * predicted.2.transpose() * inverse;
            let mut smoothed = Vector6::zeros();
            smoothed.fixed_rows_mut::<3>(0).copy_from(&ahead.position);
            smoothed.fixed_rows_mut::<3>(3).copy_from(&ahead.velocity);
            x += gain * (smoothed - predicted.0);
            p += gain * (ahead.covariance - predicted.1) * gain.transpose();
        }
        out.push(KinematicState {
            position: x.fixed_rows::<3>(0).into_owned(),
            velocity: x.fixed_rows::<3>(3).into_owned(),
            covariance: (p + p.transpose()) * 0.5,
        });
    }
    out.reverse();
    out
}

fn transition(dt: f64) -> Matrix6<f64> {
    let mut f = Matrix6::identity();
    f.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Matrix3::identity() * dt));
    f
}

/// Q = q [[dt³/3, dt²/2], [dt²/2, dt]] per axis.
fn process_noise(dt: f64, density: &Matrix3<f64>) -> Matrix6<f64> {
    let mut q = Matrix6::zeros();
    q.fixed_view_mut::<3, 3>(0, 0).copy_from(&(density * (dt.powi(3) / 3.0)));
    q.fixed_view_mut::<3, 3>(0, 3).copy_from(&(density * (dt * dt / 2.0)));
    q.fixed_view_mut::<3, 3>(3, 0).copy_from(&(density * (dt * dt / 2.0)));
    q.fixed_view_mut::<3, 3>(3, 3).copy_from(&(density * dt));
    q
}

/// Position and velocity in the world, filtered forward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionFilter {
    /// Position \[m\], velocity \[m/s\].
    pub(crate) x: Vector6<f64>,
    /// Covariance of both (6×6).
    pub(crate) p: Matrix6<f64>,
}

impl MotionFilter {
    /// At a place, of unknown velocity.
    pub(crate) fn new(position: &Vector3<f64>, covariance: &Matrix3<f64>) -> Self {
        let (mut x, mut p) = (Vector6::zeros(), Matrix6::zeros());
        x.fixed_rows_mut::<3>(0).copy_from(position);
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(covariance);
        // 15 m/s: traffic.
        p.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * 225.0));
        Self { x, p }
    }

    /// Goes on by `dt` \[s\] over a road whose normal in the world is `up`; returns the transition (6×6).
    pub(crate) fn predict(&mut self, dt: f64, up: &Vector3<f64>) -> Matrix6<f64> {
        let across = up * up.transpose();
        let density = (Matrix3::identity() - across) * ACCELERATION.powi(2) + across * HEAVE.powi(2);
        let f = transition(dt);
        self.x = f * self.x;
        self.p = f * self.p * f.transpose() + process_noise(dt, &density);
        f
    }

    /// Takes a measured place.
    pub(crate) fn update(&mut self, position: &Vector3<f64>, covariance: &Matrix3<f64>) {
        let Self { x, p } = self;
        let innovation = position - x.fixed_rows::<3>(0);
        let predicted: Matrix3<f64> = p.fixed_view::<3, 3>(0, 0).into_owned();
        let Some(inverse) = (predicted + covariance).try_inverse() else { return };
        // Beyond the 95 % quantile of χ²₃ a measurement loses weight.
        let d2 = innovation.dot(&(inverse * innovation));
        let weight = (7.8 / d2.max(1e-12)).min(1.0);
        let Some(inverse) = (predicted + covariance / weight).try_inverse() else { return };
        let gain = p.fixed_columns::<3>(0) * inverse;
        *x += gain * innovation;
        *p -= gain * p.fixed_rows::<3>(0);
        *p = (*p + p.transpose()) * 0.5;
    }
}

/// Information-weighted mean of the places of a standing vehicle, and its covariance. Frames of one track share their
/// errors (size, plane): the covariance is that of a handful of independent views, not of all.
pub fn standing_place(places: &[PositionMeasurement]) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    const INDEPENDENT: f64 = 4.0;
    let (mut information, mut sum, mut best) = (Matrix3::zeros(), Vector3::zeros(), f64::MAX);
    for place in places {
        let inverse = place.covariance.try_inverse()?;
        information += inverse;
        sum += inverse * place.position;
        best = best.min(place.covariance.trace());
    }
    let covariance = information.try_inverse()?;
    let share = (places.len() as f64 / INDEPENDENT).max(1.0);
    Some((covariance * sum, covariance * share))
}

/// Probability that a vehicle moves: its mean velocity against what errors of depth can feign, `doubt` times larger where places
/// are worse than they say.
pub fn probability_moving(places: &[PositionMeasurement], doubt: f64) -> f64 {
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return 0.5 };
    let duration = last.time_s - first.time_s;
    if duration < 0.25 {
        return 0.5;
    }
    // Slope over time of a weighted straight line through the places.
    let weight = |p: &PositionMeasurement| 1.0 / p.covariance.trace().max(1e-6);
    let w_sum: f64 = places.iter().map(weight).sum();
    let t_mean = places.iter().map(|p| weight(p) * p.time_s).sum::<f64>() / w_sum;
    let lever = |p: &PositionMeasurement| weight(p) * (p.time_s - t_mean);
    let levers: f64 = places.iter().map(|p| lever(p) * (p.time_s - t_mean)).sum::<f64>().max(1e-9);
    let velocity = places.iter().map(|p| p.position * lever(p)).sum::<Vector3<f64>>() / levers;
    let slope = |error: fn(&PositionMeasurement) -> f64| {
        places.iter().map(|p| error(p) * lever(p)).sum::<f64>() / levers
    };
    // Depth errs by a common 5 % (size, slope), and by a common share of what each place may err (pitch of the road): while the
    // range changes, this looks like motion.
    let apparent_speed = slope(|p| 0.05 * p.range_m).hypot(slope(|p| p.covariance.trace().sqrt()));
    // Noise of the line itself; neighbouring frames share most of theirs, so a handful of views count.
    let noise = (1.0 / w_sum * places.len() as f64 / 4.0).sqrt() * 3.0 / duration;
    let sigma = 0.3_f64.hypot(apparent_speed).hypot(noise) * doubt;
    // Even odds at three sigma of apparent_speed motion.
    let excess = velocity.norm() / sigma - 3.0;
    1.0 / (1.0 + (-2.0 * excess).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(speed: f64) -> Vec<PositionMeasurement> {
        (0..30)
            .map(|k| {
                let t = f64::from(k) * 0.1;
                let position = Vector3::new(2.0, 1.6, 20.0 + speed * t);
                PositionMeasurement {
                    frame: k as usize,
                    time_s: t,
                    position,
                    covariance: Matrix3::identity() * 0.09,
                    range_m: 20.0,
                }
            })
            .collect()
    }

    #[test]
    fn moving_and_standing_are_told_apart() {
        assert!(probability_moving(&places(8.0), 1.0) > 0.95);
        assert!(probability_moving(&places(0.05), 1.0) < 0.1);
    }

    /// A car that comes nearer, over a road whose pitch is taken wrongly by half a degree and thought known to a fifth: its
    /// distance errs by its square.
    #[test]
    fn a_wrong_pitch_does_not_make_a_parked_car_drive() {
        const HEIGHT_M: f64 = 1.65;
        let seen = |from_m: f64, closing_mps: f64, own_mps: f64| -> Vec<PositionMeasurement> {
            let one = |k: u32| {
                let t = f64::from(k) * 0.1;
                let range_m = from_m - closing_mps * t;
                let by_degree = 1.0_f64.to_radians() * range_m * range_m / HEIGHT_M;
                PositionMeasurement {
                    frame: k as usize,
                    time_s: t,
                    // In the world, where the camera drives.
                    position: Vector3::new(2.0, 1.6, from_m - own_mps * t + 0.5 * by_degree),
                    covariance: Matrix3::from_diagonal(&Vector3::new(
                        0.01,
                        0.01,
                        0.04 + (0.2 * by_degree).powi(2),
                    )),
                    range_m,
                }
            };
            (0..30).map(one).collect()
        };
        let (parked, oncoming) = (seen(45.0, 11.0, 0.0), seen(65.0, 19.0, 8.0));
        let feigned_mps = (parked[0].position - parked[29].position).norm() / 2.9;
        assert!(feigned_mps > 3.0, "{feigned_mps}");
        assert!(probability_moving(&parked, 1.0) < 0.2, "{}", probability_moving(&parked, 1.0));
        assert!(probability_moving(&oncoming, 1.0) > 0.95, "{}", probability_moving(&oncoming, 1.0));
    }

    #[test]
    fn smoothing_finds_the_velocity_across_a_gap() {
        let mut seen = places(8.0);
        let times: Vec<f64> = seen.iter().map(|p| p.time_s).collect();
        seen.drain(10..18);
        let states = smooth_motion(&seen, &times, &-Vector3::y());
        assert_eq!(states.len(), 30);
        for (state, t) in states.iter().zip(&times) {
            assert!((state.position.z - 20.0 - 8.0 * t).abs() < 0.05);
            assert!((state.velocity.z - 8.0).abs() < 0.2);
        }
        assert!(states[14].covariance[(2, 2)] > states[5].covariance[(2, 2)]);
        assert!(standing_place(&seen).is_some());
    }
}
