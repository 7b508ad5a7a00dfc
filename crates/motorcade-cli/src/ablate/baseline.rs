//! The baseline of the paper's Table 2: vehicles whose trajectories have a relative scale each, found by their motion.

use motorcade::{RunResult, Source, VehicleState, VehicleTrajectory};
use motorcade_geometry::{Pose, Vehicle, World};

use super::relative_scale::{RelativeScale, Sighting, relative_scale};

/// Relative scale of one vehicle.
pub struct BaselineScale {
    /// Identity of its track.
    pub track: usize,
    /// Sightings it comes from.
    pub sightings: usize,
    /// Unit of the trajectory: distance of the first sighting by the front end \[m\]. The estimate does not use it.
    pub unit_m: f64,
    /// The scale; `None` with too few sightings, and the vehicle is left out.
    pub found: Option<RelativeScale>,
}

impl BaselineScale {
    /// Length by the motion over that of the front end.
    pub fn ratio(&self) -> Option<f64> {
        self.found.map(|found| found.scale / self.unit_m)
    }

    /// Standard deviation of the scale over the scale.
    pub fn relative_sigma(&self) -> Option<f64> {
        self.found.map(|found| found.sigma / found.scale.abs())
    }
}

/// Puts the vehicles of a result where their relative scales have them, on the camera's trajectory as it is. Frames without a measurement of a vehicle have
/// no state any more.
pub fn with_relative_scales(result: &mut RunResult) -> Vec<BaselineScale> {
    let mut vehicles = std::mem::take(&mut result.vehicles);
    let mut scales = Vec::with_capacity(vehicles.len());
    for vehicle in &mut vehicles {
        vehicle.states.retain(|state| state.measurement.is_some());
        let (sightings, unit_m) = sightings(vehicle, result);
        let found = relative_scale(&sightings);
        match found {
            Some(found) => place(vehicle, &sightings, found.scale),
            None => vehicle.states.clear(),
        }
        scales.push(BaselineScale { track: vehicle.id, sightings: sightings.len(), unit_m, found });
    }
    vehicles.retain(|vehicle| !vehicle.states.is_empty());
    result.vehicles = vehicles;
    scales
}

/// The measurements of a vehicle that the paper's graph gets, in units of the first one, and that unit \[m\].
fn sightings(vehicle: &VehicleTrajectory, result: &RunResult) -> (Vec<Sighting>, f64) {
    let mut unit_m = None;
    let one = |state: &VehicleState| {
        let (frame, info) = (result.ego.frames.get(state.frame)?, result.frames.get(state.frame)?);
        let world_from_camera = frame.world_from_camera;
        let in_camera = state.measurement?.camera_from_vehicle.translation();
        let unit_m = *unit_m.get_or_insert(in_camera.norm());
        Some(Sighting {
            time_s: info.timestamp_ns as f64 * 1e-9,
            camera: world_from_camera.translation(),
            ray: world_from_camera.transform_vector(&(in_camera / unit_m)),
            up: world_from_camera.transform_vector(&frame.road_normal),
            forward: seen_rotation(state, result).map(|pose| pose.transform_vector(&nalgebra::Vector3::x())),
        })
    };
    let sightings = vehicle.states.iter().filter_map(one).collect();
    (sightings, unit_m.unwrap_or(1.0))
}

/// Pose of a vehicle as keypoints or a file of poses show its orientation. The heading of the measurement itself is that of the travel in metres, which
/// would tell the scale.
fn seen_rotation(state: &VehicleState, result: &RunResult) -> Option<Pose<World, Vehicle>> {
    let with_heading = |source| matches!(source, Source::Keypoints | Source::External);
    let seen = state.observations.iter().find(|seen| with_heading(seen.source))?;
    Some(result.ego.frames.get(state.frame)?.world_from_camera * seen.camera_from_vehicle)
}

/// Places the states of a vehicle, one a sighting. They keep their orientations.
fn place(vehicle: &mut VehicleTrajectory, sightings: &[Sighting], scale: f64) {
    for (state, sighting) in vehicle.states.iter_mut().zip(sightings) {
        let position = sighting.camera + sighting.ray * scale;
        state.world_from_vehicle = Pose::from_parts(state.world_from_vehicle.rotation(), position);
    }
}
