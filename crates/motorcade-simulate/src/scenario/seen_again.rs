//! Drives that come to the same places again, or to places that look alike.

use motorcade_perception::VehicleClass::Car;

use super::parts::{bend, coming, street};
use crate::motion::{Bend, SpeedPlan};
use crate::plan::{Plan, Route, Staging, Twins};

/// Round a block to the right, keeping to the right.
pub(super) fn block() -> Plan {
    let quarter = |length_m: f64| bend(length_m, -std::f64::consts::FRAC_PI_2 / length_m);
    let mut plan = street(SpeedPlan::constant(7.0));
    plan.road.bends =
        [70.0, 50.0, 70.0, 50.0].into_iter().flat_map(|l| [bend(l, 0.0), quarter(25.0)]).collect();
    plan.road.closed = true;
    // Rounds begin in the middle of a street.
    plan.ego_route = Route::Along { start_m: 30.0, offsets_m: vec![(0.0, -1.75)] };
    plan.drivers = vec![coming(Car, 130.0, 6.5)];
    plan.parked_chance = 0.12;
    plan
}

/// Round eight blocks of a town of straight streets: six corners to the right, two to the left.
pub(super) fn town() -> Plan {
    const CORNER_M: f64 = 25.0;
    let quarter = std::f64::consts::FRAC_PI_2;
    // From corner to corner, and the turn at its end: 1 to the left, -1 to the right.
    let sides = [
        (200.0, -1.0),
        (120.0, -1.0),
        (80.0, 1.0),
        (120.0, -1.0),
        (200.0, -1.0),
        (140.0, -1.0),
        (80.0, 1.0),
        (100.0, -1.0),
    ];
    let cut_m = 2.0 * CORNER_M / quarter;
    let mut plan = street(SpeedPlan::through(&town_speeds()));
    plan.road.bends = sides
        .into_iter()
        .flat_map(|(side_m, turn)| [bend(side_m - cut_m, 0.0), bend(CORNER_M, turn * quarter / CORNER_M)])
        .collect();
    plan.road.closed = true;
    plan.ego_route = Route::Along { start_m: 30.0, offsets_m: vec![(0.0, -1.75)] };
    plan.drivers = (1..6).map(|k| coming(Car, 170.0 * f64::from(k), 5.0 + f64::from(k % 3))).collect();
    plan.parked_chance = 0.12;
    plan
}

/// A way of 3.6 km through the streets of a town, some of which are driven again in the same direction: about the length and the loops of KITTI
/// odometry 00, not its streets.
pub(super) fn suburb() -> Plan {
    const BLOCK_M: f64 = 90.0;
    // In blocks.
    let corners = [
        (0.0, 0.0),
        (2.0, 0.0),
        (2.0, 1.5),
        (0.0, 1.5),
        (0.0, 0.0),
        (2.0, 0.0),
        (4.0, 0.0),
        (4.0, -1.8),
        (1.0, -1.8),
        (1.0, 0.0),
        (2.0, 0.0),
        (2.0, 1.5),
        (2.0, 3.2),
        (-1.2, 3.2),
        (-1.2, 0.0),
        (0.0, 0.0),
        (2.0, 0.0),
        (4.0, 0.0),
        (4.0, 3.2),
        (2.0, 3.2),
        (-1.2, 3.2),
        (-1.2, 0.0),
        (0.0, 0.0),
        (2.0, 0.0),
        (4.0, 0.0),
        (6.0, 0.0),
    ];
    let speeds = (0..7).flat_map(|k| {
        let start_s = 70.0 * f64::from(k);
        [(0.0, 8.8), (52.0, 8.8), (57.0, 0.0), (60.0, 0.0), (65.0, 8.8)].map(|(t, v)| (start_s + t, v))
    });
    let mut plan = street(SpeedPlan::through(&speeds.collect::<Vec<_>>()));
    plan.road.corners_m = corners.into_iter().map(|(x, y)| [BLOCK_M * x, BLOCK_M * y]).collect();
    let offsets_m = vec![(0.0, -1.75), (800.0, -2.1), (1900.0, -1.5), (2900.0, -1.9), (3800.0, -1.6)];
    plan.ego_route = Route::Along { start_m: 10.0, offsets_m };
    plan.drivers = (1..8).map(|k| coming(Car, 450.0 * f64::from(k), 6.0 + f64::from(k % 3))).collect();
    plan.parked_chance = 0.12;
    plan
}

/// A stop at a light every 75 s, else 8 m/s.
fn town_speeds() -> Vec<(f64, f64)> {
    (0..8)
        .flat_map(|k| {
            let start_s = 75.0 * f64::from(k);
            [(0.0, 8.0), (50.0, 8.0), (55.0, 0.0), (59.0, 0.0), (64.0, 8.0)].map(|(t, v)| (start_s + t, v))
        })
        .collect()
}

/// Two loops of 270°, one to the left and one to the right, that cross at a right angle.
pub(super) fn figure_eight() -> Plan {
    let turn = 1.5 * std::f64::consts::PI;
    let loops = |share: f64, sign: f64| bend(104.0 * share, sign * turn / 104.0);
    let straight: Bend = bend(44.0, 0.0);
    let mut plan = street(SpeedPlan::constant(6.0));
    plan.road.bends = vec![loops(0.5, 1.0), straight, loops(1.0, -1.0), straight, loops(0.5, 1.0)];
    plan.road.crossings_m = vec![74.0, 222.0];
    plan.road.closed = true;
    plan.ego_route = Route::Along { start_m: 20.0, offsets_m: vec![(0.0, -1.75)] };
    plan
}

/// The block, dark from the beginning of the second round on for ten seconds.
pub(super) fn tunnel() -> Plan {
    Plan { staging: Staging { dark_s: vec![(55.0, 65.0)], ..Staging::default() }, ..block() }
}

/// The houses from 30 to 70 m stand again from 120 to 160 m.
pub(super) fn twin_houses() -> Plan {
    let mut plan = street(SpeedPlan::constant(8.0));
    plan.staging.twins = Some(Twins { from_m: 30.0, length_m: 40.0, away_m: 90.0 });
    plan
}

/// There in one lane and back in the other.
pub(super) fn same_street_opposite() -> Plan {
    let speeds = [(0.0, 8.0), (11.0, 8.0), (14.0, 3.0), (22.0, 3.0), (25.0, 8.0)];
    let mut plan = street(SpeedPlan::through(&speeds));
    plan.road.half_width_m = 8.5;
    plan.ego_route = Route::ThereAndBack { start_m: 0.0, turn_m: 112.0 };
    plan
}
