//! States of vehicles of a drive of any length: the newest in memory, older ones in a temporary file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};

use motorcade_geometry::Pose;
use motorcade_perception::BoundingBox;
use motorcade_vehicles::{Source, VehicleState, VehicleTrajectory};
use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion};

/// Numbers of a state: identity, row, pose, covariance, box and a flag of it, score, speed and its σ, yaw rate, source.
const NUMBERS: usize = 1 + 1 + 7 + 36 + 5 + 1 + 2 + 1 + 1;
/// Rows after which states are moved: many at once.
const EVERY: usize = 256;

/// States that were moved out of memory, without the measurements that they were estimated from.
#[derive(Default)]
pub(super) struct VehicleArchive {
    /// None before the first state is moved.
    file: Option<File>,
    /// States in the file.
    count: usize,
    /// Row before which states were moved.
    moved_before: usize,
    /// True once the file could not be written: everything stays in memory from then on.
    failed: bool,
}

impl VehicleArchive {
    /// Moves the states before `row` to the file, but for the last of each vehicle.
    pub fn put_away_before(&mut self, row: usize, vehicles: &mut BTreeMap<usize, VehicleTrajectory>) {
        if self.failed || row < self.moved_before + EVERY {
            return;
        }
        self.moved_before = row;
        let old = |v: &VehicleTrajectory| {
            v.states.partition_point(|s| s.frame < row).min(v.states.len().saturating_sub(1))
        };
        let numbers = vehicles.values().flat_map(|v| v.states[..old(v)].iter().flat_map(|s| encode(v.id, s)));
        let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
        if bytes.is_empty() {
            return;
        }
        if self.file.is_none() {
            self.file = tempfile::tempfile().ok();
        }
        let written = self.file.as_mut().is_some_and(|file| file.write_all(&bytes).is_ok());
        if !written {
            self.failed = true;
            return;
        }
        self.count += bytes.len() / (8 * NUMBERS);
        for vehicle in vehicles.values_mut() {
            drop(vehicle.states.drain(..old(vehicle)));
            vehicle.states.shrink_to(2 * vehicle.states.len());
        }
    }

    /// Puts the states back before those in memory; a warning where they could not be read.
    pub fn give_back(self, vehicles: &mut BTreeMap<usize, VehicleTrajectory>) -> Option<String> {
        let mut states: BTreeMap<usize, Vec<VehicleState>> = BTreeMap::new();
        if let Err(error) = self.file.map_or(Ok(()), |file| read_back(file, self.count, &mut states)) {
            let count = self.count;
            return Some(format!(
                "{count} states of vehicles are lost: a temporary file did not read back ({error})"
            ));
        }
        for (id, mut older) in states {
            if let Some(vehicle) = vehicles.get_mut(&id) {
                older.append(&mut vehicle.states);
                vehicle.states = older;
            }
        }
        None
    }
}

fn read_back(
    mut file: File,
    count: usize,
    states: &mut BTreeMap<usize, Vec<VehicleState>>,
) -> io::Result<()> {
    file.seek(SeekFrom::Start(0))?;
    let mut reader = BufReader::new(file);
    let mut bytes = [0; 8 * NUMBERS];
    for _ in 0..count {
        reader.read_exact(&mut bytes)?;
        let (id, state) = decode(&bytes);
        states.entry(id).or_default().push(state);
    }
    Ok(())
}

fn encode(id: usize, state: &VehicleState) -> [f64; NUMBERS] {
    let (t, q) = (state.world_from_vehicle.translation(), state.world_from_vehicle.rotation());
    let bbox = state.bbox.map_or([0.0; 5], |b| [1.0, b.x1, b.y1, b.x2, b.y2]);
    let source = match state.source {
        Source::Box => 0.0,
        Source::Keypoints => 1.0,
        Source::External => 2.0,
        Source::Predicted => 3.0,
    };
    let mut numbers = [id as f64, state.frame as f64, t.x, t.y, t.z, q.i, q.j, q.k, q.w]
        .into_iter()
        .chain(state.covariance.iter().copied())
        .chain(bbox)
        .chain([state.score, state.speed_mps, state.speed_sigma_mps, state.yaw_rate_radps, source]);
    std::array::from_fn(|_| numbers.next().unwrap_or(0.0))
}

fn decode(bytes: &[u8; 8 * NUMBERS]) -> (usize, VehicleState) {
    let mut numbers = bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b));
    let mut next = || numbers.next().unwrap_or(0.0);
    let (id, frame) = (next() as usize, next() as usize);
    let translation = Translation3::new(next(), next(), next());
    let (i, j, k, w) = (next(), next(), next(), next());
    // The quaternion is a unit one already; another rounding would change its bytes.
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    let covariance = Matrix6::zeros().map(|_: f64| next());
    let (seen, x1, y1, x2, y2) = (next(), next(), next(), next(), next());
    let [score, speed_mps, speed_sigma_mps, yaw_rate_radps] = std::array::from_fn(|_| next());
    let source = match next() as u8 {
        0 => Source::Box,
        1 => Source::Keypoints,
        2 => Source::External,
        _ => Source::Predicted,
    };
    let state = VehicleState {
        frame,
        world_from_vehicle: Pose::new(Isometry3::from_parts(translation, rotation)),
        covariance,
        bbox: (seen > 0.0).then_some(BoundingBox { x1, y1, x2, y2 }),
        score,
        speed_mps,
        speed_sigma_mps,
        yaw_rate_radps,
        source,
        measurement: None,
        observations: Vec::new(),
    };
    (id, state)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_perception::VehicleClass;
    use motorcade_vehicles::Dimensions;
    use nalgebra::{Matrix3, Vector6};

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
