//! States of vehicles of a drive of any length: the newest in memory, older ones in a temporary file.

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;

use motorcade_vehicles::{VehicleState, VehicleTrajectory};

use crate::archive::{Archive, ArchiveState, not_read_back};

/// Rows after which states are moved: many at once.
const EVERY: usize = 256;

/// States that were moved out of memory with the identity of their vehicle, without the measurements that they were estimated from.
#[derive(Default)]
pub(super) struct VehicleArchive {
    states: Archive<(usize, VehicleState)>,
    /// Row before which states were moved.
    moved_before: usize,
}

/// The archive between two frames.
#[derive(serde::Serialize, serde::Deserialize)]
pub(super) struct VehicleArchiveState {
    states: ArchiveState,
    moved_before: usize,
}

impl VehicleArchive {
    /// With a file of this name.
    pub fn named(path: PathBuf) -> Self {
        Self { states: Archive::named(path), moved_before: 0 }
    }

    /// The state after the last frame.
    pub fn state(&self) -> io::Result<VehicleArchiveState> {
        let Self { states, moved_before } = self;
        Ok(VehicleArchiveState { states: states.state()?, moved_before: *moved_before })
    }

    /// As in a state, with the file of this one.
    pub fn resumed(&self, state: &VehicleArchiveState) -> io::Result<Self> {
        let VehicleArchiveState { states, moved_before } = state;
        Ok(Self { states: self.states.resumed(states)?, moved_before: *moved_before })
    }

    /// Moves the states before `row` to a temporary file, but for the last of each vehicle.
    pub fn put_away_before(&mut self, row: usize, vehicles: &mut BTreeMap<usize, VehicleTrajectory>) {
        if row < self.moved_before + EVERY {
            return;
        }
        self.moved_before = row;
        let mut moved = Vec::new();
        for vehicle in vehicles.values_mut() {
            let states = &mut vehicle.states;
            let old = states.partition_point(|s| s.frame < row).min(states.len().saturating_sub(1));
            moved.extend(states.drain(..old).map(|state| (vehicle.id, state)));
            states.shrink_to(2 * states.len());
        }
        self.states.put_away(moved);
    }

    /// Puts the states back before those in memory; a warning where they could not be read.
    pub fn give_back(mut self, vehicles: &mut BTreeMap<usize, VehicleTrajectory>) -> Option<String> {
        let count = self.states.len();
        let moved = match self.states.take_back() {
            Ok(moved) => moved,
            Err(error) => return Some(not_read_back(&format!("{count} states of vehicles"), &error)),
        };
        let mut older: BTreeMap<usize, Vec<VehicleState>> = BTreeMap::new();
        moved.into_iter().for_each(|(id, state)| older.entry(id).or_default().push(state));
        for (id, mut older) in older {
            if let Some(vehicle) = vehicles.get_mut(&id) {
                older.append(&mut vehicle.states);
                vehicle.states = older;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use motorcade_perception::{BoundingBox, VehicleClass};
    use motorcade_vehicles::{Dimensions, Source};
    use nalgebra::{Matrix3, Matrix6, Vector6};

    fn state(id: usize, frame: usize) -> VehicleState {
        let number = |i: usize| ((frame * 131 + i * 17 + id) as f64).sin();
        VehicleState {
            frame,
            world_from_vehicle: Pose::exp(&Vector6::from_fn(|i, _| number(i))),
            covariance: Matrix6::from_fn(|i, j| number(7 + 6 * i + j)),
            bbox: frame.is_multiple_of(3).then(|| BoundingBox::new([50, 51, 52, 53].map(number))),
            score: number(54),
            speed_mps: number(55),
            speed_sigma_mps: number(56),
            yaw_rate_radps: number(57),
            source: [Source::Box, Source::Keypoints, Source::External, Source::Predicted][frame % 4],
            measurement: None,
            observations: Vec::new(),
            heading_variance: 0.0,
            rival: None,
        }
    }

    #[test]
    fn states_come_back_as_they_were_and_few_are_in_memory() {
        let mut vehicles = BTreeMap::new();
        for id in [3, 8] {
            let size = Dimensions { length_m: 4.2, width_m: 1.8, height_m: 1.5 };
            let vehicle = VehicleTrajectory {
                id,
                class: VehicleClass::Car,
                size,
                size_covariance: Matrix3::identity(),
                size_by_road: None,
                p_moving: 0.0,
                states: Vec::new(),
            };
            vehicles.insert(id, vehicle);
        }
        let mut archive = VehicleArchive::default();
        for frame in 0..3000_usize {
            // The second one is seen for a while only.
            for id in [3, 8].into_iter().filter(|id| *id == 3 || frame < 700) {
                vehicles.get_mut(&id).unwrap().states.push(state(id, frame));
            }
            archive.put_away_before((frame + 1).saturating_sub(150), &mut vehicles);
            let kept: usize = vehicles.values().map(|v| v.states.len()).sum();
            assert!(kept < 2 * 600, "{kept}");
        }
        assert_eq!(vehicles[&8].states.len(), 1);
        assert_eq!(archive.give_back(&mut vehicles), None);
        for (id, frames) in [(3, 3000), (8, 700)] {
            let found = &vehicles[&id].states;
            assert_eq!(found.len(), frames);
            for (frame, found) in found.iter().enumerate() {
                assert_eq!(format!("{found:?}"), format!("{:?}", state(id, frame)));
            }
        }
    }
}
