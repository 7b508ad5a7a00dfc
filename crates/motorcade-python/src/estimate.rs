//! The estimate of the newest frame as a dictionary.

use motorcade::{Estimate, VehicleEstimate};
use motorcade_vehicles::Dimensions;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;

/// Camera and vehicles of the newest frame.
pub fn dictionary<'py>(py: Python<'py>, estimate: &Estimate) -> PyResult<Bound<'py, PyDict>> {
    let (out, ego) = (PyDict::new(py), &estimate.ego);
    out.set_item("frame", estimate.frame.number)?;
    out.set_item("time_ns", estimate.frame.timestamp_ns)?;
    out.set_item("status", motorcade::output::status_name(ego.status))?;
    out.set_item("pose", arrays::pose(py, &ego.world_from_camera)?)?;
    out.set_item("covariance", arrays::covariance(py, &ego.covariance)?)?;
    out.set_item("speed_mps", estimate.speed_mps)?;
    let n = ego.road_normal;
    out.set_item("road_normal", arrays::vector(py, [n.x, n.y, n.z].into_iter()))?;
    let vehicles: Vec<_> = estimate.vehicles.iter().map(|v| vehicle(py, v)).collect::<PyResult<_>>()?;
    out.set_item("vehicles", vehicles)?;
    Ok(out)
}

fn vehicle<'py>(py: Python<'py>, vehicle: &VehicleEstimate) -> PyResult<Bound<'py, PyDict>> {
    let (out, state) = (PyDict::new(py), &vehicle.state);
    let three = |d: Dimensions| arrays::vector(py, [d.length_m, d.width_m, d.height_m].into_iter());
    out.set_item("id", vehicle.id)?;
    out.set_item("class_name", vehicle.class.name())?;
    out.set_item("size_m", three(vehicle.size))?;
    out.set_item("size_sigma_m", three(vehicle.size_sigma()))?;
    out.set_item("p_moving", vehicle.p_moving)?;
    out.set_item("pose", arrays::pose(py, &state.world_from_vehicle)?)?;
    out.set_item("covariance", arrays::covariance(py, &state.covariance)?)?;
    out.set_item("speed_mps", state.speed_mps)?;
    out.set_item("speed_sigma_mps", state.speed_sigma_mps)?;
    out.set_item("yaw_rate_radps", state.yaw_rate_radps)?;
    Ok(out)
}
