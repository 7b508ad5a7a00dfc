//! Colours of vehicles, those of the report.

use foxglove::messages::Color;
use motorcade::RecordedVehicle;
use motorcade_viewer::{MOVING, hue, rgb};

/// The colour of the vehicle with this index.
pub(crate) fn of(index: usize, vehicle: &RecordedVehicle, opacity: f64) -> Color {
    let [r, g, b] = rgb(hue(index), vehicle.p_moving > MOVING);
    Color { r, g, b, a: opacity }
}
