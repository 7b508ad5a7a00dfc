//! Options of vehicle headings.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Headings from travel, from boxes and from external poses, and their uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HeadingOptions {
    /// Speed below which the heading is held: the direction of travel is undefined at a stop \[m/s\].
    pub hold_speed_mps: f64,
    /// Time over which external headings are averaged \[s\]: single-view headings scatter by degrees and flip now and then.
    pub averaging_time_s: f64,
    /// Most external headings that are averaged, spread over that time.
    pub averaged_views: usize,
    /// Distance of the rear axle behind the middle as a share of the length: of road vehicles 0.29 to 0.31. It moves along the heading, the middle does not in a bend.
    pub rear_axle_share: f64,
    /// Orientations tried for a static vehicle, evenly over half a turn.
    pub orientations: usize,
    /// Boxes of a track that are compared at each of them.
    pub compared_boxes: usize,
    /// Cost \[χ²\] of standing across the road: most vehicles are parked along it.
    pub across_cost: f64,
    /// Cost \[χ²\] of an oblique orientation, at 45°: rare, and the one boxes constrain least.
    pub oblique_cost: f64,
    /// Standard deviation of the error that a network's headings of one standing vehicle have in common \[rad\]: 68 % of 24 standing cars of KITTI 0005
    /// and 0003, most of them 30 px high, lie within it. A larger one trusts the direction of the road more.
    pub view_sigma_rad: f64,
    /// Standard deviation of the heading of a vehicle that is parked along the road or across it \[rad\]: that of two thirds of the standing cars with
    /// labels in KITTI 0001 and 0007.
    pub parked_sigma_rad: f64,
    /// Share of the standing vehicles that are parked along the road, of either direction; as for `across_share` about that of KITTI 0001 and 0007. A
    /// larger one turns more oblique ones into it.
    pub along_share: f64,
    /// Share of those that are parked across it; the others are oblique.
    pub across_share: f64,
    /// Share of the standing vehicles that face against the traffic of their side, where boxes alone do not tell their front: 20 of 126 with labelled boxes in KITTI
    /// 0001 and 0007.
    pub reversed_share: f64,
    /// Lateral distance beyond which a parked vehicle faces as the traffic of its side does \[m\].
    pub roadside_m: f64,
    /// Standard deviation of the heading of a box, from travel or parking direction \[rad\].
    pub box_sigma_rad: f64,
    /// Standard deviation of roll and pitch of a vehicle against the plane in one frame \[rad\]: cross-fall and crown.
    pub tilt_sigma_rad: f64,
    /// Smallest standard deviation of the heading of a smoothed state \[rad\].
    pub state_sigma_rad: f64,
    /// Largest standard deviation of the heading of a smoothed state \[rad\].
    pub state_most_sigma_rad: f64,
    /// Standard deviation of roll and pitch of a smoothed state \[rad\].
    pub state_tilt_sigma_rad: f64,
    /// Growth of the heading's standard deviation with the time between states \[rad/s\].
    pub state_drift_radps: f64,
    /// Shortest time over which yaw rates are measured \[s\]: single-view headings are noisy at high frame rates. Longer times smooth
    /// the yaw rate.
    pub yaw_rate_time_s: f64,
}

impl Default for HeadingOptions {
    fn default() -> Self {
        Self {
            hold_speed_mps: 1.5,
            averaging_time_s: 0.9,
            averaged_views: 9,
            rear_axle_share: 0.3,
            orientations: 12,
            compared_boxes: 12,
            across_cost: 2.0,
            oblique_cost: 2.0,
            view_sigma_rad: 0.15,
            parked_sigma_rad: 0.05,
            along_share: 0.7,
            across_share: 0.1,
            reversed_share: 0.16,
            roadside_m: 2.0,
            box_sigma_rad: 0.035,
            tilt_sigma_rad: 0.03,
            state_sigma_rad: 2.0_f64.to_radians(),
            state_most_sigma_rad: 1.0,
            state_tilt_sigma_rad: 2.0_f64.to_radians(),
            state_drift_radps: 0.01,
            yaw_rate_time_s: 0.1,
        }
    }
}

impl HeadingOptions {
    /// The most probable angle of a standing vehicle to the road \[rad\] for one by a network, and its variance \[rad²\]; `road_sigma` is the standard deviation
    /// of the road's direction. The angle itself where it is oblique, else the mean of it and of the direction along the road or across it, by their
    /// variances. The variance is about that angle, over all of these.
    pub(crate) fn parked_angle(&self, by_views: f64, road_sigma: f64) -> (f64, f64) {
        let of_views = self.view_sigma_rad.powi(2);
        let of_parked = self.parked_sigma_rad.powi(2) + road_sigma.powi(2);
        let variance = of_views + of_parked;
        let oblique = (1.0 - self.along_share - self.across_share).max(0.0) / TAU;
        // Density of each kind, its mean from the angle by the network, and its variance.
        let mut kinds = vec![(oblique, 0.0, of_views)];
        for (quarter, share) in [self.along_share, self.across_share].repeat(2).into_iter().enumerate() {
            let off = (by_views - FRAC_PI_2 * quarter as f64 + PI).rem_euclid(TAU) - PI;
            let density = 0.5 * share * (-0.5 * off * off / variance).exp() / (TAU * variance).sqrt();
            kinds.push((density, -off * of_views / variance, of_views * of_parked / variance));
        }
        let best = kinds.iter().copied().rev().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |kind| kind.1);
        let sum: f64 = kinds.iter().map(|kind| kind.0).sum();
        let squared = |(density, mean, own): &(f64, f64, f64)| density * (own + (mean - best).powi(2));
        (by_views + best, kinds.iter().map(squared).sum::<f64>() / sum.max(f64::MIN_POSITIVE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_near_the_road_are_drawn_to_it_and_oblique_ones_stay() {
        let options = HeadingOptions::default();
        let angle = |degrees: f64| options.parked_angle(degrees.to_radians(), 0.0).0.to_degrees();
        assert!(
            (angle(0.0)).abs() < 1e-9 && (angle(10.0) - 1.0).abs() < 0.1 && (angle(-20.0) + 2.0).abs() < 0.2
        );
        assert!((angle(172.0) - 179.2).abs() < 0.1 && (angle(-172.0) + 179.2).abs() < 0.1);
        assert!((angle(86.0) - 89.6).abs() < 0.1 && (angle(-95.0) + 90.5).abs() < 0.1);
        assert!((angle(45.0) - 45.0).abs() < 1e-9 && (angle(-135.0) + 135.0).abs() < 1e-9);
        // A bending road says less by its direction.
        assert!(options.parked_angle(0.2, 0.15).0 > 0.09);
        // Along the road it is known as well as parked vehicles stand, between that and an oblique one no better than the two are apart.
        let sigma = |degrees: f64| options.parked_angle(degrees.to_radians(), 0.0).1.sqrt().to_degrees();
        assert!((2.5..4.0).contains(&sigma(0.0)), "{}", sigma(0.0));
        assert!(sigma(25.0) > 12.0 && (8.0..12.0).contains(&sigma(45.0)), "{} {}", sigma(25.0), sigma(45.0));
    }
}
