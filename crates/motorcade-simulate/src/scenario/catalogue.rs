//! The built-in scenarios.

use motorcade_perception::VehicleClass::{Bus, Car, Truck, Van};

use super::junctions::{junction_turn, roundabout_exits, yard};
use super::parts::{bend, coming, driver, leading, standing, street};
use super::seen_again::{block, figure_eight, same_street_opposite, suburb, town, tunnel, twin_houses};
use super::traffic::{crest, double_parked, motorway, parked_across, trailers};
use crate::motion::{Grade, SpeedPlan};
use crate::options::DetectorOptions;
use crate::plan::{Plan, Route, Side};

/// One scenario.
pub(super) struct Entry {
    pub name: &'static str,
    pub description: &'static str,
    pub plan: fn() -> Plan,
}

macro_rules! entries {
    ($($name:literal, $plan:ident, $description:literal;)*) => {
        pub(super) const ENTRIES: &[Entry] =
            &[$(Entry { name: $name, description: $description, plan: $plan }),*];
    };
}

entries! {
    "demo", demo, "12 s on a gently bending street: a leading, an oncoming and a crossing car, two parked ones";
    "straight", straight, "a straight street at 11 m/s, one car ahead, no other traffic";
    "bends", bends, "an S-bend, one car ahead and two oncoming";
    "slope", slope, "up a hill of 6 % and down again behind a van";
    "stop-and-go", stop_and_go, "a queue: behind a car that stops and starts twice";
    "standing-start", standing_start, "standing at a light behind two cars for four seconds, then starting";
    "roundabout", roundabout, "straight over a roundabout: right, a tight left arc, right";
    "oncoming", oncoming, "a stream of oncoming cars, a van and a truck on a straight road";
    "crossing", crossing, "cars crossing from both sides while the camera slows down for them";
    "overtaking", overtaking, "a car overtakes the camera and cuts in ahead";
    "turning", turning, "a car ahead turns off right, another turns in from the right";
    "parked", parked, "a narrow street with parked cars on both sides, no traffic";
    "rough", rough, "a rough road: pitch and roll oscillate by half a degree behind a car";
    "truck", truck, "behind a truck and a bus that occlude much of the view";
    "dense", dense, "parked cars, leading, oncoming and crossing traffic at once";
    "empty", empty, "a winding street without vehicles";
    "crowd", crowd, "past two rows of parked cars and two oncoming queues: more than 60 vehicles in a frame";
    "pitched", pitched, "the camera looks 5 degrees down, behind a car";
    "rolled", rolled, "the camera is rolled by 2 degrees, behind a car";
    "low-camera", low_camera, "the camera is 1.2 m above the road, in a low car";
    "high-camera", high_camera, "the camera is 2.5 m above the road, in a truck";
    "false-boxes", false_boxes, "false detections on structures beside the road";
    "glimpses", glimpses, "vehicles detected in one frame of twelve, a false detection in most frames";
    "lorries", lorries, "trucks and buses ahead, oncoming and crossing";
    "jumping-boxes", jumping_boxes, "one box in six jumps by up to a quarter of its size";
    "block", block, "round a block of houses, 340 m a round, 49 s; parked cars, one oncoming";
    "figure-eight", figure_eight, "a figure of eight, 296 m a round, 50 s, over its own crossing";
    "tunnel", tunnel, "round the block, in the second round 10 s without light";
    "town-10min", town, "round eight blocks of a town, 986 m a round, stops at lights, 10 minutes: 4.4 rounds";
    "suburb", suburb, "3.6 km through a town in 454 s, some of its streets again in the same direction: about the length and the loops of KITTI odometry 00";
    "twin-houses", twin_houses, "a straight street in which 40 m of houses stand twice";
    "same-street-opposite", same_street_opposite, "along an avenue, round over both lanes and back";
    "parked-across", parked_across, "a street with rows of cars across it on both sides, some at 60 degrees, two cars ahead";
    "yard", yard, "from a street into a car park with rows in all directions, through it slowly and out";
    "double-parked", double_parked, "round lorries and a van that stand in the lane; cars come from behind them";
    "roundabout-exits", roundabout_exits, "three quarters round a roundabout of four arms; others enter, go round and leave";
    "junction-turn", junction_turn, "turning left at a junction; others turn left and right, and wait";
    "trailers", trailers, "behind an articulated lorry through bends; another one and a car with a caravan come";
    "motorway", motorway, "30 m/s on a motorway of three lanes each way, overtaken at 50 m/s, past lorries at 22 to 25 m/s";
    "crest", crest, "over a crest and through a dip, cars coming over them";
}

/// Errors of the detector in a scenario.
pub(super) fn detector(name: &str) -> DetectorOptions {
    let usual = DetectorOptions::default();
    match name {
        "false-boxes" => DetectorOptions { wall_boxes: 1.5, false_boxes: 0.2, ..usual },
        // Nearly every track ends in its first frame.
        "glimpses" => DetectorOptions { miss_chance: 0.92, false_boxes: 0.8, ..usual },
        "jumping-boxes" => DetectorOptions { jump_chance: 0.16, ..usual },
        _ => usual,
    }
}

fn demo() -> Plan {
    let mut plan = street(SpeedPlan::through(&[(0.0, 8.0), (4.0, 9.5), (8.0, 9.0), (12.0, 9.5)]));
    plan.road.bends = vec![bend(30.0, 0.0), bend(45.0, 0.008), bend(25.0, 0.0), bend(45.0, -0.007)];
    plan.road.crossings_m = vec![118.0];
    plan.drivers = vec![
        leading(Car, 15.0, SpeedPlan::through(&[(0.0, 8.0), (4.0, 9.7), (8.0, 8.7), (12.0, 9.6)])),
        coming(Car, 105.0, 8.0),
        driver(
            Car,
            Route::Crossing { crossing: 0, from: Side::Right, distance_m: 52.0 },
            SpeedPlan::constant(5.5),
        ),
        standing(34.0, Side::Right),
        standing(72.0, Side::Right),
    ];
    plan
}

fn straight() -> Plan {
    let mut plan = street(SpeedPlan::constant(11.0));
    plan.drivers = vec![leading(Car, 18.0, SpeedPlan::constant(11.2))];
    plan
}

fn bends() -> Plan {
    let mut plan = street(SpeedPlan::constant(9.0));
    plan.road.bends = vec![bend(30.0, 0.0), bend(50.0, 0.022), bend(20.0, 0.0), bend(55.0, -0.025)];
    plan.drivers =
        vec![leading(Car, 16.0, SpeedPlan::constant(9.2)), coming(Car, 90.0, 8.0), coming(Van, 190.0, 9.0)];
    plan
}

fn slope() -> Plan {
    let mut plan = street(SpeedPlan::constant(10.0));
    let grade = |length_m, rise| Grade { length_m, rise };
    plan.road.grades = vec![grade(25.0, 0.0), grade(60.0, 0.06), grade(20.0, 0.0), grade(70.0, -0.05)];
    plan.drivers = vec![leading(Van, 17.0, SpeedPlan::constant(10.0)), coming(Car, 150.0, 9.0)];
    plan
}

fn stop_and_go() -> Plan {
    let own = [
        (0.0, 7.0),
        (2.0, 6.0),
        (4.5, 0.0),
        (6.5, 0.0),
        (9.0, 6.0),
        (11.0, 6.0),
        (13.5, 0.0),
        (15.0, 0.0),
        (18.0, 8.0),
    ];
    // The car ahead has the same speeds one second earlier.
    let ahead: Vec<(f64, f64)> = own.iter().map(|(t, v)| (t - 1.0, *v)).collect();
    let mut plan = street(SpeedPlan::through(&own));
    plan.drivers = vec![leading(Car, 13.0, SpeedPlan::through(&ahead)), coming(Car, 60.0, 7.0)];
    plan.parked_chance = 0.25;
    plan
}

fn standing_start() -> Plan {
    let start = |after: f64| SpeedPlan::through(&[(after, 0.0), (after + 4.5, 9.0)]);
    let mut plan = street(start(4.0));
    plan.road.crossings_m = vec![26.0];
    plan.drivers = vec![
        leading(Car, 8.0, start(3.2)),
        leading(Car, 15.5, start(2.4)),
        driver(
            Car,
            Route::Crossing { crossing: 0, from: Side::Left, distance_m: 22.0 },
            SpeedPlan::constant(8.0),
        ),
    ];
    plan
}

fn roundabout() -> Plan {
    let mut plan = street(SpeedPlan::through(&[(0.0, 8.0), (4.0, 5.5), (11.0, 5.5), (14.0, 8.0)]));
    plan.road.bends = vec![bend(32.0, 0.0), bend(17.0, -0.045), bend(34.0, 0.045), bend(17.0, -0.045)];
    plan.drivers =
        vec![leading(Car, 14.0, SpeedPlan::through(&[(0.0, 7.8), (3.0, 5.5), (10.0, 5.5), (13.0, 8.0)]))];
    plan
}

fn oncoming() -> Plan {
    let mut plan = street(SpeedPlan::constant(10.0));
    let classes = [Car, Van, Car, Truck, Car, Car, Van];
    plan.drivers =
        classes.iter().enumerate().map(|(i, class)| coming(*class, 50.0 + 38.0 * i as f64, 10.0)).collect();
    plan
}

fn crossing() -> Plan {
    let mut plan = street(SpeedPlan::through(&[(0.0, 9.0), (3.0, 7.0), (5.0, 3.0), (7.0, 3.0), (10.0, 9.0)]));
    plan.road.crossings_m = vec![48.0, 110.0];
    let over = |crossing, from, distance_m, speed| {
        driver(Car, Route::Crossing { crossing, from, distance_m }, SpeedPlan::constant(speed))
    };
    plan.drivers = vec![
        over(0, Side::Left, 16.0, 7.0),
        over(0, Side::Right, 30.0, 7.5),
        over(0, Side::Left, 36.0, 7.5),
        over(1, Side::Right, 80.0, 6.5),
    ];
    plan
}

fn overtaking() -> Plan {
    let mut plan = street(SpeedPlan::constant(8.0));
    plan.drivers = vec![
        driver(
            Car,
            Route::Along { start_m: -12.0, offsets_m: vec![(0.0, 1.6), (45.0, 1.6), (75.0, -1.75)] },
            SpeedPlan::through(&[(0.0, 12.0), (6.0, 12.5), (9.0, 10.0), (12.0, 9.0)]),
        ),
        leading(Van, 60.0, SpeedPlan::constant(8.5)),
    ];
    plan
}

fn turning() -> Plan {
    let mut plan = street(SpeedPlan::through(&[(0.0, 8.0), (3.0, 6.0), (6.0, 6.0), (9.0, 9.0)]));
    plan.road.crossings_m = vec![45.0, 85.0];
    plan.drivers = vec![
        driver(
            Car,
            Route::TurnOff { start_m: 15.0, crossing: 0, to: Side::Right },
            SpeedPlan::through(&[(0.0, 8.0), (2.5, 5.0), (5.0, 5.0), (7.0, 8.0)]),
        ),
        driver(
            Car,
            Route::TurnIn { crossing: 1, distance_m: 28.0 },
            SpeedPlan::through(&[(0.0, 4.0), (5.0, 4.5), (8.0, 9.0)]),
        ),
        coming(Car, 120.0, 8.0),
    ];
    plan
}

fn parked() -> Plan {
    let mut plan = street(SpeedPlan::constant(8.0));
    plan.parked_chance = 0.6;
    plan
}

fn rough() -> Plan {
    let mut plan = straight();
    plan.ego_speed = SpeedPlan::constant(9.0);
    plan.rig.oscillation_rad = 0.5_f64.to_radians();
    plan.drivers = vec![leading(Car, 17.0, SpeedPlan::constant(9.2))];
    plan
}

fn truck() -> Plan {
    let mut plan = street(SpeedPlan::constant(9.0));
    plan.road.bends = vec![bend(60.0, 0.0), bend(60.0, 0.006)];
    plan.drivers = vec![
        leading(Truck, 20.0, SpeedPlan::constant(9.0)),
        leading(Bus, 42.0, SpeedPlan::constant(9.3)),
        coming(Car, 110.0, 9.0),
    ];
    plan
}

fn dense() -> Plan {
    let mut plan = demo();
    plan.parked_chance = 0.4;
    plan.drivers.extend([
        coming(Van, 150.0, 8.0),
        coming(Car, 210.0, 8.5),
        leading(Car, 60.0, SpeedPlan::constant(9.3)),
    ]);
    plan
}

fn empty() -> Plan {
    let mut plan = street(SpeedPlan::constant(10.0));
    plan.road.bends = vec![bend(30.0, 0.0), bend(40.0, 0.015), bend(20.0, 0.0), bend(40.0, -0.015)];
    plan
}

fn crowd() -> Plan {
    let mut plan = street(SpeedPlan::constant(7.0));
    plan.road.half_width_m = 9.2;
    plan.parked_chance = 1.0;
    // One queue in the outer lane in the same direction and one oncoming, both bumper to bumper.
    for i in 0..22 {
        let far_lane = vec![(0.0, -5.2)];
        let start_m = 14.0 + 8.5 * f64::from(i);
        let queue = Route::Along { start_m, offsets_m: far_lane };
        plan.drivers.push(driver(Car, queue, SpeedPlan::constant(3.0)));
        plan.drivers.push(coming(Car, start_m + 4.0, 2.0));
    }
    plan
}

/// A gentle S-bend behind one car, for scenarios that vary the camera.
fn following() -> Plan {
    let mut plan = street(SpeedPlan::constant(10.0));
    plan.road.bends = vec![bend(40.0, 0.0), bend(40.0, 0.008), bend(40.0, -0.008)];
    plan.drivers = vec![leading(Car, 16.0, SpeedPlan::constant(10.1)), coming(Car, 120.0, 9.0)];
    plan
}

fn pitched() -> Plan {
    let mut plan = following();
    plan.rig.pitch_rad = 5.0_f64.to_radians();
    plan
}

fn rolled() -> Plan {
    let mut plan = following();
    plan.rig.roll_rad = 2.0_f64.to_radians();
    plan
}

fn low_camera() -> Plan {
    let mut plan = following();
    plan.rig.height_m = 1.2;
    plan
}

fn high_camera() -> Plan {
    let mut plan = following();
    plan.rig.height_m = 2.5;
    plan
}

fn false_boxes() -> Plan {
    following()
}

fn glimpses() -> Plan {
    let mut plan = following();
    plan.parked_chance = 0.3;
    plan
}

fn lorries() -> Plan {
    let mut plan = street(SpeedPlan::constant(9.0));
    plan.road.half_width_m = 6.2;
    plan.road.crossings_m = vec![95.0];
    plan.drivers = vec![
        leading(Bus, 22.0, SpeedPlan::constant(9.2)),
        coming(Truck, 70.0, 8.0),
        coming(Bus, 115.0, 8.0),
        coming(Truck, 160.0, 8.0),
        driver(
            Truck,
            Route::Crossing { crossing: 0, from: Side::Right, distance_m: 75.0 },
            SpeedPlan::constant(6.0),
        ),
    ];
    plan
}

fn jumping_boxes() -> Plan {
    following()
}
