//! Drives along a road: rows of parked cars, obstacles in the lane, trailers, a motorway, crests.

use motorcade_perception::VehicleClass::{self, Bus, Car, Truck, Van};

use super::parts::{bays, bend, coming, driver, leading, placed, street, through, towing};
use crate::motion::{Grade, RoadKind, SpeedPlan};
use crate::plan::{Driver, Plan, Route};
use crate::trailer::TrailerKind;

/// Half a turn \[rad\].
const HALF_TURN: f64 = std::f64::consts::PI;
/// A quarter of a turn \[rad\].
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

/// Bays across the road on both sides, those on the right from 60 m on at 60°.
pub(super) fn parked_across() -> Plan {
    const PITCH_M: f64 = 2.7;
    const BAY_M: f64 = 8.6;
    let mut plan = street(SpeedPlan::constant(7.0));
    plan.road.paved =
        vec![bays([8.0, BAY_M], [125.0, BAY_M], 3.1), bays([8.0, -BAY_M], [125.0, -BAY_M], 3.1)];
    plan.drivers = vec![
        leading(Car, 16.0, SpeedPlan::constant(7.0)),
        leading(Car, 38.0, SpeedPlan::constant(7.2)),
        coming(Car, 95.0, 7.0),
    ];
    for i in 0..41 {
        let s_m = 9.0 + PITCH_M * f64::from(i);
        let class = if i % 9 == 4 { Van } else { Car };
        // One car in three or four with its nose to the road, and free bays.
        if i % 7 != 3 {
            let turned = if i % 3 == 1 { -QUARTER } else { QUARTER };
            plan.drivers.push(placed(class, s_m, BAY_M, turned));
        }
        if i % 8 != 5 && i < 19 {
            let turned = if i % 4 == 2 { QUARTER } else { -QUARTER };
            plan.drivers.push(placed(Car, s_m, -BAY_M, turned));
        }
    }
    for i in 0..19 {
        if i % 6 != 4 {
            plan.drivers.push(placed(Car, 62.5 + 3.3 * f64::from(i), -BAY_M, -HALF_TURN / 3.0));
        }
    }
    plan
}

/// Round lorries and a van that stand in the lane or half in it; cars come from behind them.
pub(super) fn double_parked() -> Plan {
    let mut plan =
        street(SpeedPlan::through(&[(0.0, 7.0), (2.0, 4.4), (10.0, 4.4), (12.0, 5.5), (20.0, 5.5)]));
    let offsets_m = vec![
        (15.0, -1.75),
        (28.0, 0.8),
        (42.0, 0.8),
        (54.0, -1.2),
        (64.0, -1.2),
        (77.0, 0.8),
        (92.0, 0.8),
        (106.0, -1.75),
    ];
    plan.ego_route = Route::Along { start_m: 0.0, offsets_m };
    let oncoming = |class: VehicleClass, start_m: f64, speed_m_s: f64| {
        // Closer to the kerb beside the lorries.
        let points_m = vec![[260.0, 1.9], [116.0, 1.9], [100.0, 3.4], [14.0, 3.4], [-2.0, 1.9], [-80.0, 1.9]];
        driver(class, through(points_m, 260.0 - start_m), SpeedPlan::constant(speed_m_s))
    };
    plan.drivers = vec![
        placed(Truck, 34.0, -2.1, 0.0),
        placed(Van, 59.0, -3.6, 0.0),
        placed(Truck, 83.0, -2.1, 0.0),
        oncoming(Car, 84.0, 7.0),
        oncoming(Car, 106.0, 7.0),
        oncoming(Van, 140.0, 7.5),
        oncoming(Car, 172.0, 7.5),
        oncoming(Car, 196.0, 7.5),
    ];
    plan
}

/// Behind an articulated lorry through bends; another one and a car with a caravan come.
pub(super) fn trailers() -> Plan {
    let mut plan = street(SpeedPlan::constant(9.0));
    plan.road.half_width_m = 6.4;
    plan.road.bends =
        vec![bend(25.0, 0.0), bend(55.0, 0.022), bend(15.0, 0.0), bend(55.0, -0.024), bend(20.0, 0.0)];
    let against = |class, start_m: f64, speed_m_s: f64| {
        let points_m = (0..60).map(|i| [start_m + 30.0 - 8.0 * f64::from(i), 2.1]).collect();
        driver(class, through(points_m, 30.0), SpeedPlan::constant(speed_m_s))
    };
    plan.drivers = vec![
        towing(TrailerKind::Semi, leading(Truck, 36.0, SpeedPlan::constant(9.2))),
        towing(TrailerKind::Caravan, against(Car, 78.0, 8.5)),
        towing(TrailerKind::Semi, against(Truck, 130.0, 8.5)),
        towing(TrailerKind::Caravan, leading(Car, 62.0, SpeedPlan::constant(9.4))),
    ];
    plan
}

/// The middle lane of a motorway at 30 m/s: overtaken at 50 m/s, past lorries at 22 to 25 m/s, traffic beyond the median.
pub(super) fn motorway() -> Plan {
    // Lanes from the median out.
    const LANES_M: [f64; 3] = [3.9, 7.6, 11.4];
    let mut plan = street(SpeedPlan::constant(30.0));
    plan.road.half_width_m = 16.0;
    plan.road.kind = RoadKind::Motorway;
    plan.road.bends = vec![bend(80.0, 0.0), bend(250.0, 0.0012), bend(250.0, -0.001)];
    plan.ego_route = Route::Along { start_m: 0.0, offsets_m: vec![(0.0, -LANES_M[1])] };
    let with = |class, lane: usize, start_m: f64, speed_m_s: f64| -> Driver {
        let route = Route::Along { start_m, offsets_m: vec![(0.0, -LANES_M[lane])] };
        driver(class, route, SpeedPlan::constant(speed_m_s))
    };
    let against = |class, lane: usize, start_m: f64, speed_m_s: f64| -> Driver {
        let points_m = (0..80).map(|i| [start_m + 20.0 - 20.0 * f64::from(i), LANES_M[lane]]).collect();
        driver(class, through(points_m, 20.0), SpeedPlan::constant(speed_m_s))
    };
    plan.drivers = vec![
        with(Car, 0, -14.0, 50.0),
        with(Car, 0, -75.0, 50.0),
        with(Car, 0, 55.0, 48.0),
        with(Car, 1, 32.0, 30.5),
        with(Truck, 2, 24.0, 22.0),
        with(Truck, 2, 62.0, 23.0),
        towing(TrailerKind::Semi, with(Truck, 2, 110.0, 24.5)),
        with(Van, 2, 150.0, 25.5),
        with(Bus, 2, 190.0, 25.0),
        against(Car, 0, 120.0, 38.0),
        against(Car, 1, 170.0, 33.0),
        against(Truck, 2, 110.0, 24.0),
        against(Car, 0, 260.0, 40.0),
        against(Truck, 2, 230.0, 24.0),
        against(Van, 1, 300.0, 32.0),
        against(Car, 0, 380.0, 37.0),
        against(Car, 1, 430.0, 34.0),
    ];
    plan
}

/// Over a short crest of 1.7 m and through a dip behind it: cars come over the crest, others are below the line of sight.
pub(super) fn crest() -> Plan {
    let mut plan = street(SpeedPlan::constant(9.0));
    let grade = |length_m, rise| Grade { length_m, rise };
    plan.road.grades =
        vec![grade(14.0, 0.0), grade(26.0, 0.065), grade(36.0, -0.075), grade(26.0, 0.0), grade(30.0, 0.06)];
    plan.drivers = vec![
        leading(Car, 24.0, SpeedPlan::constant(9.4)),
        coming(Car, 70.0, 9.0),
        coming(Van, 104.0, 9.0),
        coming(Car, 150.0, 9.0),
        coming(Car, 176.0, 9.0),
    ];
    plan
}
