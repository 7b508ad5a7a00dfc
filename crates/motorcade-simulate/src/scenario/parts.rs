//! Parts that plans are made of.

use motorcade_perception::VehicleClass::{self, Car};
use nalgebra::Point2;

use crate::motion::{Bend, Paved, RoadKind, RoadPlan, SpeedPlan, rounded};
use crate::plan::{Driver, Plan, Rig, Route, Side, Staging};
use crate::trailer::TrailerKind;

/// The camera keeps to the right lane.
pub(super) fn along(start_m: f64) -> Route {
    Route::Along { start_m, offsets_m: vec![(0.0, -1.75)] }
}

pub(super) fn driver(class: VehicleClass, route: Route, speed: SpeedPlan) -> Driver {
    Driver { class, route, speed, towing: None }
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

pub(super) fn towing(trailer: TrailerKind, driver: Driver) -> Driver {
    Driver { towing: Some(trailer), ..driver }
}

/// A vehicle that stands anywhere, its heading relative to the road's direction \[rad\].
pub(super) fn placed(class: VehicleClass, s_m: f64, d_m: f64, turned_rad: f64) -> Driver {
    driver(class, Route::Standing { s_m, d_m, turned_rad }, SpeedPlan::constant(0.0))
}

pub(super) fn through(points_m: Vec<[f64; 2]>, start_m: f64) -> Route {
    Route::Through { points_m, start_m }
}

/// Line through corners (s, d) that are rounded from `reach_m` before to `reach_m` after them.
pub(super) fn turning(corners_m: &[[f64; 2]], reach_m: f64) -> Vec<[f64; 2]> {
    let corners: Vec<Point2<f64>> = corners_m.iter().map(|c| Point2::from(*c)).collect();
    rounded(&corners, reach_m).into_iter().map(|p| [p.x, p.y]).collect()
}

/// Ground to park on or to drive over, round a line in (s, d).
pub(super) fn bays(from_m: [f64; 2], to_m: [f64; 2], half_width_m: f64) -> Paved {
    Paved { ends_m: [from_m, to_m], half_width_m, island_m: 0.0, centre_line: false }
}

/// A street of two lanes off the road.
pub(super) fn street_arm(from_m: [f64; 2], to_m: [f64; 2], half_width_m: f64) -> Paved {
    Paved { centre_line: true, ..bays(from_m, to_m, half_width_m) }
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
            paved: vec![],
            kind: RoadKind::Street,
        },
        ego_route: along(0.0),
        ego_speed: speed,
        rig: Rig::default(),
        drivers: vec![],
        parked_chance: 0.0,
        staging: Staging::default(),
    }
}
