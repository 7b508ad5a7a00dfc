//! Plan of a drive: road, camera, and the routes and speeds of vehicles.

use motorcade_perception::VehicleClass;

use crate::motion::{RoadPlan, SpeedPlan};
use crate::trailer::TrailerKind;

/// Left or right of the direction of the road.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Positive `d`.
    Left,
    /// Negative `d`.
    Right,
}

impl Side {
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// Route of a vehicle. Traffic keeps to the right.
#[derive(Clone, Debug, PartialEq)]
pub enum Route {
    /// Along the road in its direction, starting at `start_m`; `offsets_m` are (s, d) \[m\], eased in between.
    Along {
        /// `s` at the start \[m\].
        start_m: f64,
        /// Offsets across the road, by `s`.
        offsets_m: Vec<(f64, f64)>,
    },
    /// Against the direction of the road, in the other lane, starting at `start_m`.
    Oncoming {
        /// `s` at the start \[m\].
        start_m: f64,
    },
    /// Along the road in its direction, round over both lanes at `turn_m`, and back in the other lane.
    ThereAndBack {
        /// `s` at the start \[m\].
        start_m: f64,
        /// `s` of the turn \[m\].
        turn_m: f64,
    },
    /// Over a crossing, coming from one side.
    Crossing {
        /// Index of the road's crossing.
        crossing: usize,
        /// Side it comes from.
        from: Side,
        /// Distance from the centre of the crossing at the start \[m\].
        distance_m: f64,
    },
    /// Along the road, then off it at a crossing.
    TurnOff {
        /// `s` at the start \[m\].
        start_m: f64,
        /// Index of the road's crossing.
        crossing: usize,
        /// Side it turns to.
        to: Side,
    },
    /// Out of a crossing road onto this one, in its direction, coming from the right.
    TurnIn {
        /// Index of the road's crossing.
        crossing: usize,
        /// Distance from the centre of the crossing at the start \[m\].
        distance_m: f64,
    },
    /// Standing at the kerb.
    Parked {
        /// Along the road \[m\].
        s_m: f64,
        /// Side of its kerb; it faces in the direction of the traffic of that side.
        side: Side,
    },
    /// Through points, straight in the road's (s, d) from one to the next, and on beyond the last.
    Through {
        /// (s, d) \[m\].
        points_m: Vec<[f64; 2]>,
        /// Way from the first point to the start \[m\].
        start_m: f64,
    },
    /// Standing anywhere.
    Standing {
        /// Along the road \[m\].
        s_m: f64,
        /// To the left of its centre line \[m\].
        d_m: f64,
        /// Heading relative to the road's direction \[rad\], positive to the left.
        turned_rad: f64,
    },
}

/// A vehicle of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Driver {
    /// Class of the vehicle.
    pub class: VehicleClass,
    /// Its route.
    pub route: Route,
    /// Its speed over time; unused where it stands.
    pub speed: SpeedPlan,
    /// Its trailer.
    pub towing: Option<TrailerKind>,
}

/// The camera on its car.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig {
    /// Height above the road \[m\].
    pub height_m: f64,
    /// Pitch, positive downwards \[rad\].
    pub pitch_rad: f64,
    /// Roll, positive with the right side down \[rad\].
    pub roll_rad: f64,
    /// Amplitude of the suspension's pitch \[rad\]; roll has half of it.
    pub oscillation_rad: f64,
    /// Its frequency \[Hz\].
    pub oscillation_hz: f64,
}

impl Default for Rig {
    fn default() -> Self {
        let degree = std::f64::consts::PI / 180.0;
        // As fitted to the road of real KITTI drives.
        Self {
            height_m: 1.65,
            pitch_rad: 0.3 * degree,
            roll_rad: 0.4 * degree,
            oscillation_rad: 0.2 * degree,
            oscillation_hz: 1.4,
        }
    }
}

/// Plan of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The road.
    pub road: RoadPlan,
    /// The car with the camera.
    pub ego_route: Route,
    /// Its speed.
    pub ego_speed: SpeedPlan,
    /// The camera.
    pub rig: Rig,
    /// The other planned vehicles.
    pub drivers: Vec<Driver>,
    /// Probability of a parked car at each kerb position, every 7 m on both sides; 0 for none.
    pub parked_chance: f64,
    /// Houses that look alike, and darkness.
    pub staging: Staging,
}

/// Houses that look alike, and darkness.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Staging {
    /// A stretch of the road whose scenery stands a second time.
    pub twins: Option<Twins>,
    /// Times from and to which no light reaches the camera, as in a tunnel without lamps \[s\].
    pub dark_s: Vec<(f64, f64)>,
}

/// A stretch of the road whose houses, gardens and trees stand a second time farther on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twins {
    /// `s` of its beginning \[m\].
    pub from_m: f64,
    /// Its length \[m\], less than `away_m`.
    pub length_m: f64,
    /// Distance of the second one along the road \[m\].
    pub away_m: f64,
}
