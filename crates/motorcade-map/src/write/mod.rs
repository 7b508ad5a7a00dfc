//! The files.

mod geojson;
mod gpx;
mod kml;
mod oxts;
mod places;
mod xml;
mod xosc;

pub use geojson::geojson;
pub use gpx::gpx;
pub use kml::kml;
pub use oxts::oxts;
pub use places::places_geojson;
pub use xosc::xosc;

use motorcade::{RecordedFrame, RecordedVehicle};
use motorcade_dataset::Geodetic;

use crate::anchor::Placed;

/// Name of the camera's way in the files.
const CAMERA: &str = "camera";

fn name(vehicle: &RecordedVehicle) -> String {
    format!("{} {}", vehicle.class, vehicle.id)
}

/// Standard deviation of the position of the camera in the world of the run \[m\].
fn position_sigma_m(frame: &RecordedFrame) -> f64 {
    let c = &frame.covariance;
    (c[(3, 3)] + c[(4, 4)] + c[(5, 5)]).max(0.0).sqrt()
}

/// Places of the camera, one a frame.
fn camera(placed: &Placed<'_>) -> Vec<(i64, Geodetic)> {
    let frames = placed.run.frames.iter();
    frames.map(|f| (f.timestamp_ns, placed.place(&f.world_from_camera.translation()))).collect()
}

/// Places of a vehicle, one a state.
fn vehicle(placed: &Placed<'_>, vehicle: &RecordedVehicle) -> Vec<(i64, Geodetic)> {
    let states = vehicle.states.iter();
    let time = |row: usize| placed.run.frames.get(row).map_or(0, |f| f.timestamp_ns);
    states.map(|s| (time(s.row), placed.place(&s.world_from_vehicle.translation()))).collect()
}

#[cfg(test)]
mod tests;
