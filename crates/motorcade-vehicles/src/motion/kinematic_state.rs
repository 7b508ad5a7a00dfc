//! Probability that a vehicle moves.

use nalgebra::{Matrix3, Vector3};

use crate::motion::PositionMeasurement;
use crate::motion::line::Line;
use crate::options::AdvancedVehicleOptions;
use crate::time::independent_views;

/// Probability that a vehicle moves: the slope of a line through its positions over time, against the apparent speed that errors
/// of depth cause. `inflation` is a factor on its standard deviation for boxes that fit worse than their covariances say. With a
/// known `forward` direction (unit vector, world frame) only the speed along it counts: vehicles do not slide, errors of depth
/// point anywhere.
pub fn probability_moving(
    positions: &[PositionMeasurement],
    forward: Option<&Vector3<f64>>,
    inflation: f64,
    options: &AdvancedVehicleOptions,
) -> f64 {
    let (Some(first), Some(last)) = (positions.first(), positions.last()) else { return 0.5 };
    let duration = last.time_s - first.time_s;
    let traffic_mps = options.motion.initial_speed_sigma_mps;
    let (options, correlation_time_s) = (&options.kinematic_state, options.correlation_time_s);
    if duration < options.shortest_s {
        return 0.5;
    }
    let line = Line::new(positions, options);
    let velocity = line.velocity();
    // A relative depth error common to all positions (size, slope), a common multiple of each position's own standard deviation along the
    // line of sight (pitch of the road), and the centre of a vehicle against the side that is seen, look like motion while range and line of
    // sight change.
    let modes: [Vector3<f64>; 3] = [
        line.slope_of(|p| p.toward * (options.common_depth_share * p.range_m)),
        line.slope_of(|p| p.toward * p.covariance.trace().sqrt()),
        line.slope_of(|p| p.toward * options.common_centre_m),
    ];
    // Noise of the line: all positions together have the weight of a few independent ones. Their scatter about the line shows how far
    // their covariances, which hold errors common to all as well, are from it: a scaled inverse χ² with a prior of `noise_dof`.
    let count = positions.len();
    let independent = independent_views(count, duration, correlation_time_s, options.independent_views);
    let freedom = (independent_views(count, duration, correlation_time_s, f64::MAX) - 2.0).max(0.0);
    let prior = options.noise_dof;
    let scatter = (prior + line.reduced_scatter() * freedom) / (prior + freedom);
    let noise =
        line.velocity_covariance() * (options.noise_factor.powi(2) * scatter * count as f64 / independent);
    let floor = Matrix3::identity() * options.speed_floor_mps.powi(2);
    let covariance =
        modes.iter().fold(floor + noise, |sum, mode| sum + mode * mode.transpose()) * inflation.powi(2);
    let sigma_along =
        |direction: &Vector3<f64>| (direction.transpose() * covariance * direction)[0].max(0.0).sqrt();
    // Log odds of moving at so many standard deviations of speed.
    let log_odds = |sigmas: f64| options.logistic_slope * (sigmas - options.even_odds_sigmas);
    let along = |forward: &Vector3<f64>| {
        let sigmas = velocity.dot(forward) / sigma_along(forward);
        if sigmas >= 0.0 {
            return log_odds(sigmas);
        }
        let reversed = log_odds(-sigmas) + options.reversed_share.ln();
        log_odds(-options.backward_share * sigmas).max(reversed)
    };
    let free =
        || covariance.try_inverse().map_or(0.0, |i| (velocity.transpose() * i * velocity)[0].max(0.0).sqrt());
    let log_odds = forward.map_or_else(|| log_odds(free()), along);
    let sigma = sigma_along(&velocity.try_normalize(1e-9).unwrap_or_else(Vector3::z));
    // A speed that is hardly known says little: standing never has more confidence than a measured speed of zero would give
    // it against the speeds of traffic (Bayes factor; Kass and Raftery, JASA 1995).
    let of_zero = (sigma / sigma.hypot(traffic_mps)).ln();
    1.0 / (1.0 + (-log_odds.max(of_zero)).exp())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::Matrix3;

    pub(in crate::motion) fn positions(speed_mps: f64) -> Vec<PositionMeasurement> {
        (0..30)
            .map(|k| {
                let t = f64::from(k) * 0.1;
                let position = Vector3::new(2.0, 1.6, 20.0 + speed_mps * t);
                PositionMeasurement {
                    frame: k as usize,
                    time_s: t,
                    position,
                    covariance: Matrix3::identity() * 0.09,
                    range_m: 20.0,
                    toward: Vector3::z(),
                }
            })
            .collect()
    }

    fn moving(positions: &[PositionMeasurement]) -> f64 {
        probability_moving(positions, None, 1.0, &AdvancedVehicleOptions::default())
    }

    #[test]
    fn moving_and_static_vehicles_are_separated() {
        assert!(moving(&positions(8.0)) > 0.95);
        assert!(moving(&positions(0.05)) < 0.1);
    }

    /// A car seen for three tenths of a second, a metre of error in each position: nobody knows.
    #[test]
    fn a_speed_that_is_hardly_known_does_not_show_standing() {
        let seen = |speed_mps: f64| {
            let mut few = positions(speed_mps)[..4].to_vec();
            for (p, error_m) in few.iter_mut().zip([1.0, -1.0, -1.0, 1.0]) {
                p.covariance = Matrix3::identity();
                p.position.z += error_m;
            }
            moving(&few)
        };
        assert!((0.15..0.5).contains(&seen(0.0)), "{}", seen(0.0));
        assert!((0.15..0.6).contains(&seen(5.0)), "{}", seen(5.0));
    }

    /// Covariances hold what is common to all positions too: positions of an oncoming car that lie on a line show that it moves.
    #[test]
    fn positions_on_a_line_show_more_than_scattered_ones() {
        let mut by_covariances = AdvancedVehicleOptions::default();
        by_covariances.kinematic_state.noise_dof = 1e9;
        let seen = |scatter_m: f64, options: &AdvancedVehicleOptions| {
            let mut seen = positions(5.0)[..13].to_vec();
            for (k, p) in seen.iter_mut().enumerate() {
                p.covariance = Matrix3::identity() * 1.5;
                p.position.z += if k % 2 == 0 { scatter_m } else { -scatter_m };
            }
            probability_moving(&seen, None, 1.0, options)
        };
        let usual = AdvancedVehicleOptions::default();
        let [on_a_line, scattered] = [0.1, 4.0].map(|scatter_m| seen(scatter_m, &usual));
        let by_covariances = seen(0.1, &by_covariances);
        assert!(on_a_line > by_covariances + 0.05, "{on_a_line}, {by_covariances}");
        assert!(scattered < on_a_line - 0.05, "{scattered}, {on_a_line}");
    }

    #[test]
    fn a_vehicle_moves_along_its_heading() {
        let options = AdvancedVehicleOptions::default();
        let along =
            |forward: Vector3<f64>| probability_moving(&positions(3.0), Some(&forward), 1.0, &options);
        // The same apparent speed: ahead, along the road, and across it, as errors of depth look on a parked car.
        assert!(along(Vector3::z()) > 0.95);
        assert!(along(Vector3::x()) < 0.1);
        let reversing = along(-Vector3::z());
        assert!(reversing < along(Vector3::z()) && reversing > along(Vector3::x()), "{reversing}");
    }

    /// An oncoming lorry that a network takes for one seen from behind.
    #[test]
    fn a_vehicle_that_is_fast_backwards_has_its_heading_the_wrong_way_round() {
        let backwards = |speed_mps: f64, reversed_share: f64| {
            let mut options = AdvancedVehicleOptions::default();
            options.kinematic_state.reversed_share = reversed_share;
            probability_moving(&positions(speed_mps), Some(&-Vector3::z()), 5.0, &options)
        };
        // At 5.3 standard deviations; with half of them, as of one that reverses, it would rather stand.
        assert!(backwards(8.0, 0.05) > 0.8 && backwards(8.0, 1e-9) < 0.5, "{}", backwards(8.0, 0.05));
        // A slow one is as likely to stand.
        assert!(backwards(2.0, 0.05) < 0.1, "{}", backwards(2.0, 0.05));
    }

    /// An approached car on a road whose pitch is wrong by half a degree, five times its standard deviation: its distance errs
    /// by its square.
    #[test]
    fn a_wrong_pitch_does_not_move_a_parked_car() {
        const HEIGHT_M: f64 = 1.65;
        let approached = |from_m: f64, closing_mps: f64, own_mps: f64| -> Vec<PositionMeasurement> {
            let one = |k: u32| {
                let t = f64::from(k) * 0.1;
                let range_m = from_m - closing_mps * t;
                let by_degree = 1.0_f64.to_radians() * range_m * range_m / HEIGHT_M;
                let variance_z = 0.04 + (0.2 * by_degree).powi(2);
                PositionMeasurement {
                    frame: k as usize,
                    time_s: t,
                    position: Vector3::new(2.0, 1.6, from_m - own_mps * t + 0.5 * by_degree),
                    covariance: Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, variance_z)),
                    range_m,
                    toward: Vector3::z(),
                }
            };
            (0..30).map(one).collect()
        };
        let (parked, oncoming) = (approached(45.0, 11.0, 0.0), approached(65.0, 19.0, 8.0));
        let apparent_mps = (parked[0].position - parked[29].position).norm() / 2.9;
        assert!(apparent_mps > 3.0, "{apparent_mps}");
        assert!(moving(&parked) < 0.2, "{}", moving(&parked));
        assert!(moving(&oncoming) > 0.95, "{}", moving(&oncoming));
    }
}
