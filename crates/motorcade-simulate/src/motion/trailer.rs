//! Kinematics of a trailer: its axle does not slip sideways, its hitch moves with the towing vehicle.

use nalgebra::Point2;

use super::{PlanarState, axes};

/// Positions of hitch and axle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hitch {
    /// Hitch ahead of the centre of the towing vehicle \[m\], negative behind it.
    pub ahead_m: f64,
    /// Distance from the hitch back to the trailer's axle \[m\].
    pub to_axle_m: f64,
    /// Distance from the hitch back to the centre of the trailer's body \[m\].
    pub to_centre_m: f64,
}

/// States of the body centre of a trailer, one per state of the towing vehicle; `axle` is where the trailer's axle is at first.
///
/// The axle follows the hitch at a constant distance, as in the limit of small steps dθ/dt = v/L · sin φ, with the speed v of the hitch, its direction φ
/// relative to the trailer, and the distance L from hitch to axle.
pub(crate) fn tow(leading: &[PlanarState], hitch: &Hitch, axle: Point2<f64>) -> Vec<PlanarState> {
    let mut axle = axle;
    let one = |state: &PlanarState| {
        let at = state.centre + axes(state.heading_rad).0 * hitch.ahead_m;
        let forward = (at - axle).normalize();
        axle = at - forward * hitch.to_axle_m;
        PlanarState {
            centre: at - forward * hitch.to_centre_m,
            heading_rad: forward.y.atan2(forward.x),
            speed_m_s: state.speed_m_s,
        }
    };
    leading.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const L: f64 = 7.7;
    const STEP_S: f64 = 0.01;
    /// Hitch over the rear axle, which is 1.7 m behind the centre.
    const HITCH: Hitch = Hitch { ahead_m: -1.7, to_axle_m: L, to_centre_m: 5.2 };

    /// A tractor whose rear axle drives along a circle to the left of radius `radius_m`, for `seconds`.
    fn circling(radius_m: f64, speed_m_s: f64, seconds: f64) -> Vec<PlanarState> {
        let state = |i: usize| {
            let heading_rad = i as f64 * STEP_S * speed_m_s / radius_m;
            let (forward, left) = axes(heading_rad);
            let rear = Point2::origin() - left * radius_m;
            PlanarState { centre: rear + forward * 1.7, heading_rad, speed_m_s }
        };
        (0..(seconds / STEP_S) as usize).map(state).collect()
    }

    fn angle_between(tractor: &PlanarState, trailer: &PlanarState) -> f64 {
        (tractor.heading_rad - trailer.heading_rad).sin().asin()
    }

    #[test]
    fn the_yaw_rate_is_speed_over_length_by_the_sine_of_the_angle() {
        let tractor = circling(15.0, 6.0, 4.0);
        let axle = tractor[0].centre - axes(0.0).0 * (1.7 + L);
        let trailer = tow(&tractor, &HITCH, axle);
        for (i, pair) in trailer.windows(2).enumerate() {
            let turned = (pair[1].heading_rad - pair[0].heading_rad).sin() / STEP_S;
            let angle =
                0.5 * (angle_between(&tractor[i], &pair[0]) + angle_between(&tractor[i + 1], &pair[1]));
            assert!((turned - 6.0 / L * angle.sin()).abs() < 2e-3, "{i}: {turned} rad/s at {angle} rad");
        }
        assert!(angle_between(&tractor[300], &trailer[300]) > 0.4);
    }

    #[test]
    fn on_a_circle_the_angle_settles_where_the_axle_has_a_circle_of_its_own() {
        let tractor = circling(15.0, 6.0, 20.0);
        let trailer = tow(&tractor, &HITCH, tractor[0].centre - axes(0.0).0 * (1.7 + L));
        let (last, behind) = (tractor[tractor.len() - 1], trailer[trailer.len() - 1]);
        assert!((angle_between(&last, &behind) - (L / 15.0).asin()).abs() < 2e-3);
        let axle = behind.centre - axes(behind.heading_rad).0 * (L - HITCH.to_centre_m);
        assert!((axle.coords.norm() - (15.0_f64.powi(2) - L * L).sqrt()).abs() < 0.02);
    }

    #[test]
    fn behind_a_straight_drive_it_is_straight() {
        let state = |i: i32| PlanarState {
            centre: Point2::new(0.1 * f64::from(i), 0.0),
            heading_rad: 0.0,
            speed_m_s: 10.0,
        };
        let tractor: Vec<_> = (0..50).map(state).collect();
        let trailer = tow(&tractor, &HITCH, Point2::new(-1.7 - L, 0.0));
        assert!(
            trailer
                .iter()
                .zip(&tractor)
                .all(|(a, b)| a.heading_rad == 0.0 && (b.centre.x - a.centre.x - 6.9).abs() < 1e-9)
        );
    }
}
