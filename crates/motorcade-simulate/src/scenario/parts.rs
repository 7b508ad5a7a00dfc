//! Parts that plans are made of.

use motorcade_perception::VehicleClass::{self, Car};

use crate::motion::{Bend, RoadPlan, SpeedPlan};
use crate::plan::{Driver, Plan, Rig, Route, Side, Staging};

/// The camera keeps to the right lane.
pub(super) fn along(start_m: f64) -> Route {
    Route::Along { start_m, offsets_m: vec![(0.0, -1.75)] }
}

pub(super) fn driver(class: VehicleClass, route: Route, speed: SpeedPlan) -> Driver {
    Driver { class, route, speed }
}

pub(super) fn leading(class: VehicleClass, ahead_m: f64, speed: SpeedPlan) -> Driver {
    driver(class, along(ahead_m), speed)
}

pub(super) fn coming(class: VehicleClass, start_m: f64, speed_m_s: f64) -> Driver {
    driver(class, Route::Oncoming { start_m }, SpeedPlan::constant(speed_m_s))
}

pub(super) fn standing(s_m: f64, side: Side) -> Driver {
    driver(Car, Route::Parked { s_m, side }, SpeedPlan::constant(0.0))
}

pub(super) fn bend(length_m: f64, curvature_per_m: f64) -> Bend {
    Bend { length_m, curvature_per_m }
}

/// A straight level street without traffic.
pub(super) fn street(speed: SpeedPlan) -> Plan {
    Plan {
        road: RoadPlan {
            half_width_m: 5.6,
            bends: vec![],
            grades: vec![],
            crossings_m: vec![],
            closed: false,
            corners_m: vec![],
        },
        ego_route: along(0.0),
        ego_speed: speed,
        rig: Rig::default(),
        drivers: vec![],
        parked_chance: 0.0,
        staging: Staging::default(),
    }
}
