//! Labels of vehicles.

use motorcade::{RecordedState, RecordedVehicle};
use motorcade_viewer::MOVING;

/// Identity, class and speed.
pub(crate) fn label(vehicle: &RecordedVehicle, state: &RecordedState) -> String {
    let name = format!("{} {}", vehicle.class, vehicle.id);
    if vehicle.p_moving > MOVING { format!("{name}, {:.0} km/h", 3.6 * state.speed_mps) } else { name }
}
