//! Colours of vehicles, those of the report.

use foxglove::messages::Color;
use motorcade::RecordedVehicle;
use motorcade_viewer::{MOVING, hue};

/// The colour of the vehicle with this index: strong where it moves, pale where it is parked.
pub(crate) fn of(index: usize, vehicle: &RecordedVehicle, opacity: f64) -> Color {
    let (saturation, lightness) = if vehicle.p_moving > MOVING { (0.95, 0.55) } else { (0.45, 0.65) };
    let chroma = (1.0 - (2.0 * lightness - 1.0_f64).abs()) * saturation;
    // Distance of the hue from red, green and blue on the colour circle.
    let channel = |offset: f64| {
        let h = (f64::from(hue(index)) / 60.0 + offset).rem_euclid(6.0);
        let share = ((h - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        lightness - 0.5 * chroma + chroma * share
    };
    Color { r: channel(0.0), g: channel(4.0), b: channel(2.0), a: opacity }
}
