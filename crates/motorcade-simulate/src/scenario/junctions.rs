//! Drives on which the camera and others turn: a yard, a roundabout, a junction.

use motorcade_perception::VehicleClass::{self, Car, Truck, Van};

use super::parts::{bays, driver, placed, street, street_arm, through, turning};
use super::roundabout::Roundabout;
use crate::motion::SpeedPlan;
use crate::plan::{Driver, Plan};

/// A quarter of a turn \[rad\].
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

/// From a street into a car park with rows in all directions, through it and out to the street.
pub(super) fn yard() -> Plan {
    // Entry and exit along s, the lane between them along d.
    const IN_M: f64 = 24.0;
    const OUT_M: f64 = 58.0;
    const DEEP_M: f64 = -36.0;
    let mut plan = street(SpeedPlan::through(&[(0.0, 6.5), (1.5, 4.5), (20.0, 4.5), (24.0, 7.0)]));
    plan.road.paved = vec![
        bays([IN_M, -3.0], [IN_M, -14.0], 4.0),
        bays([OUT_M, -3.0], [OUT_M, -14.0], 4.0),
        bays([IN_M + 6.0, -28.0], [OUT_M - 6.0, -28.0], 18.0),
    ];
    let way =
        [[-20.0, -1.75], [IN_M, -1.75], [IN_M, DEEP_M], [OUT_M, DEEP_M], [OUT_M, -1.75], [130.0, -1.75]];
    plan.ego_route = through(turning(&way, 7.0), 26.0);
    let row = |ends: [[f64; 2]; 2], turned: f64| {
        let [[s, d], [s_end, d_end]] = ends;
        let pitch_m = 2.75;
        let (ds, dd) = (s_end - s, d_end - d);
        let count = (ds.hypot(dd) / pitch_m).floor() as u32;
        (0..=count).filter(move |i| (i * 5 + count) % 7 != 3).map(move |i| {
            let share = f64::from(i) * pitch_m / ds.hypot(dd);
            let class = if i % 6 == 5 { Van } else { Car };
            // One car in four, parked backwards.
            let back = if (i * 3 + count) % 4 == 1 { std::f64::consts::PI } else { 0.0 };
            placed(class, s + share * ds, d + share * dd, turned + back)
        })
    };
    plan.drivers = [
        row([[IN_M - 6.2, -16.0], [IN_M - 6.2, -38.0]], std::f64::consts::PI),
        row([[IN_M + 6.2, -15.5], [IN_M + 6.2, -25.0]], 0.0),
        row([[OUT_M - 6.2, -15.5], [OUT_M - 6.2, -25.0]], std::f64::consts::PI),
        row([[OUT_M + 6.2, -16.0], [OUT_M + 6.2, -38.0]], 0.0),
        row([[IN_M + 5.0, DEEP_M - 6.0], [OUT_M - 5.0, DEEP_M - 6.0]], -QUARTER),
    ]
    .into_iter()
    .flatten()
    .collect();
    // Vehicles between the lanes, askew and along them.
    plan.drivers.extend([
        placed(Car, 36.5, -24.0, 0.8),
        placed(Truck, 41.5, -18.0, QUARTER),
        placed(Car, 46.5, -24.5, -0.7),
    ]);
    let out = [[OUT_M, DEEP_M - 1.0], [OUT_M, -1.75], [150.0, -1.75]];
    let leaving = through(turning(&out, 7.0), 10.0);
    plan.drivers.push(driver(
        Car,
        leaving,
        SpeedPlan::through(&[(2.0, 0.0), (5.0, 4.5), (11.0, 4.5), (13.0, 7.5)]),
    ));
    plan
}

/// A roundabout of four arms: vehicles enter, go round by a quarter to three quarters, and leave.
pub(super) fn roundabout_exits() -> Plan {
    let round = Roundabout { centre_m: [40.0, 0.0], outer_m: 18.0, island_m: 9.5 };
    let mut plan = street(SpeedPlan::through(&[
        (0.0, 6.5),
        (4.0, 1.5),
        (6.0, 1.5),
        (8.0, 5.0),
        (20.0, 5.0),
        (23.0, 8.0),
    ]));
    plan.road.paved = vec![
        round.paved(),
        street_arm([40.0, 16.0], [40.0, 120.0], 3.6),
        street_arm([40.0, -16.0], [40.0, -120.0], 3.6),
    ];
    // Arms by their angle to the road: 0 ahead, 90° left, 180° where the camera comes from, 270° right.
    let [ahead, left, back, right] = [0.0, QUARTER, 2.0 * QUARTER, 3.0 * QUARTER];
    plan.ego_route = through(round.way(back, left, 60.0), 34.0);
    let going = |class: VehicleClass, from, to, before_m: f64, speed_m_s: f64| -> Driver {
        let way = through(round.way(from, to, 100.0), 100.0 - before_m);
        driver(class, way, SpeedPlan::constant(speed_m_s))
    };
    plan.drivers = vec![
        // Arm of entry, arm of exit, way to the entry.
        going(Car, left, right, 6.0, 5.2),
        going(Car, ahead, back, 8.0, 5.2),
        going(Car, left, ahead, 38.0, 5.2),
        going(Van, ahead, right, 30.0, 5.2),
        going(Car, back, right, 13.0, 5.2),
        going(Car, ahead, back, 52.0, 5.2),
        going(Car, right, left, 98.0, 5.2),
    ];
    plan
}

/// A junction: the camera turns left, others turn left and right, and wait.
pub(super) fn junction_turn() -> Plan {
    const AT_M: f64 = 36.0;
    let mut plan = street(SpeedPlan::through(&[(0.0, 7.0), (2.5, 4.5), (8.0, 4.5), (11.0, 8.0)]));
    plan.road.crossings_m = vec![AT_M];
    plan.road.paved =
        vec![street_arm([AT_M, 6.0], [AT_M, 130.0], 5.6), street_arm([AT_M, -6.0], [AT_M, -130.0], 5.6)];
    // Lanes of the crossing road: traffic to the left keeps to larger s, traffic to the right to smaller s.
    let (leftward, rightward) = (AT_M + 1.75, AT_M - 1.75);
    plan.ego_route = through(turning(&[[-30.0, -1.75], [leftward, -1.75], [leftward, 140.0]], 8.5), 34.0);
    let along = |corners: &[[f64; 2]], reach_m, start_m: f64, speed| {
        driver(Car, through(turning(corners, reach_m), start_m), speed)
    };
    let steady = SpeedPlan::constant;
    plan.drivers = vec![
        // Car ahead of the camera, turning right.
        along(&[[-30.0, -1.75], [rightward, -1.75], [rightward, -140.0]], 6.5, 48.0, steady(5.0)),
        // Oncoming car, turning right into the arm the camera turns into.
        along(
            &[[140.0, 1.75], [leftward, 1.75], [leftward, 140.0]],
            6.5,
            99.0,
            SpeedPlan::through(&[(0.0, 4.8), (4.0, 5.0), (7.0, 9.0)]),
        ),
        // Oncoming car, waiting to turn left until the camera has gone.
        along(
            &[[140.0, 1.75], [rightward, 1.75], [rightward, -140.0]],
            8.5,
            91.5,
            SpeedPlan::through(&[(8.0, 0.0), (11.0, 4.5), (14.0, 4.5), (17.0, 8.0)]),
        ),
        // Car from the left, waiting, then turning right.
        along(
            &[[rightward, 140.0], [rightward, 1.75], [-140.0, 1.75]],
            6.5,
            128.0,
            SpeedPlan::through(&[(2.0, 0.0), (5.0, 4.0), (8.0, 4.0), (11.0, 8.0)]),
        ),
        // Car from the right, waiting, then turning left behind the camera.
        along(
            &[[leftward, -140.0], [leftward, 1.75], [-140.0, 1.75]],
            8.5,
            127.0,
            SpeedPlan::through(&[(9.5, 0.0), (12.5, 4.5), (16.0, 4.5), (19.0, 8.0)]),
        ),
        // Car that comes later along the arm that the camera turns into.
        along(
            &[[rightward, 140.0], [rightward, -140.0]],
            6.5,
            60.0,
            SpeedPlan::through(&[(0.0, 6.0), (6.0, 6.0), (9.5, 0.0)]),
        ),
        // Vehicles parked in the arms.
        placed(Car, AT_M + 4.5, 24.0, QUARTER),
        placed(Van, AT_M - 4.5, 33.0, -QUARTER),
        placed(Car, AT_M + 4.5, 46.0, QUARTER),
        placed(Car, AT_M + 4.5, -22.0, QUARTER),
    ];
    plan
}
