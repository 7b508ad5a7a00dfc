//! The vehicles of a run.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_geometry::{Pose, Vehicle, World};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::frames::RecordedFrame;
use super::table::{NamedRow, Table};
use crate::error::Result;

/// A vehicle of a run.
#[derive(Clone, Debug)]
pub struct RecordedVehicle {
    /// Identity.
    pub id: u64,
    /// Name of its class.
    pub class: String,
    /// Length, width, height \[m\].
    pub size_m: [f64; 3],
    /// Probability that it moves during the track.
    pub p_moving: f64,
    /// States in order of frames.
    pub states: Vec<RecordedState>,
}

/// A vehicle in one frame.
#[derive(Clone, Debug)]
pub struct RecordedState {
    /// Row of the frame in the run.
    pub row: usize,
    /// Pose \[m\].
    pub world_from_vehicle: Pose<World, Vehicle>,
    /// Speed over the road, forward positive \[m/s\].
    pub speed_mps: f64,
    /// Standard deviations of the position in the world along the vehicle's forward, left and up axes \[m\].
    pub sigma_m: [f64; 3],
    /// True when it was not seen in this frame.
    pub predicted: bool,
    /// Score of the detector in this frame; 0 where it was not seen.
    pub score: f64,
}

pub(super) fn read(path: &Path, frames: &[RecordedFrame]) -> Result<Vec<RecordedVehicle>> {
    let table = Table::read(path)?;
    let mut vehicles = BTreeMap::<u64, RecordedVehicle>::new();
    for row in table.rows() {
        let number = row.whole("frame")?;
        let Ok(at) = frames.binary_search_by_key(&number, |f| f.number) else {
            return Err(row.error("a frame of frames.csv", format!("frame {number}")).into());
        };
        let id = row.whole("id")?;
        let state = state(&row, at)?;
        if let Some(vehicle) = vehicles.get_mut(&id) {
            if vehicle.states.last().is_some_and(|before| before.row >= at) {
                return Err(row
                    .error("rows in order of frames, one a vehicle", format!("vehicle {id} again"))
                    .into());
            }
            vehicle.states.push(state);
            continue;
        }
        let vehicle = RecordedVehicle {
            id,
            class: row.text("class")?,
            size_m: row.numbers(["length_m", "width_m", "height_m"])?,
            p_moving: row.number("p_moving")?,
            states: vec![state],
        };
        vehicles.insert(id, vehicle);
    }
    Ok(vehicles.into_values().collect())
}

fn state(row: &NamedRow<'_>, at: usize) -> Result<RecordedState> {
    let [x, y, z] = row.numbers(["x_m", "y_m", "z_m"])?;
    let [i, j, k, w] = row.numbers(["qx", "qy", "qz", "qw"])?;
    let quaternion = Quaternion::new(w, i, j, k);
    if (quaternion.norm() - 1.0).abs() > 0.01 {
        return Err(row.error("a unit quaternion", format!("norm {:.4}", quaternion.norm())).into());
    }
    let rotation = UnitQuaternion::new_normalize(quaternion);
    Ok(RecordedState {
        row: at,
        world_from_vehicle: Pose::from_parts(rotation, Vector3::new(x, y, z)),
        speed_mps: row.number("speed_mps")?,
        sigma_m: row.numbers(["sigma_forward_m", "sigma_left_m", "sigma_up_m"])?,
        predicted: row.text("source")? == "predicted",
        score: row.number("score")?,
    })
}
