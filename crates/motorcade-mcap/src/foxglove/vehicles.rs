//! Vehicles in the world.

use foxglove::messages::line_primitive::Type;
use foxglove::messages::{
    self, CubePrimitive, Duration, KeyValuePair, LinePrimitive, Point3, SceneEntity, SceneEntityDeletion,
    SceneUpdate, TextPrimitive, scene_entity_deletion,
};
use motorcade::{RecordedRun, RecordedState, RecordedVehicle};
use motorcade_geometry::{Pose, World};
use motorcade_viewer::MOVING;
use nalgebra::Vector3;

use super::colour;
use super::convert::{pose, timestamp};
use crate::frames::WORLD;
use crate::label::label;

/// The vehicles of a frame in place of those of the frame before. `states`: index of the vehicle and of its state.
pub(crate) fn update(run: &RecordedRun, time_ns: i64, states: &[(usize, usize)]) -> SceneUpdate {
    let everything = SceneEntityDeletion {
        timestamp: Some(timestamp(time_ns)),
        r#type: scene_entity_deletion::Type::All.into(),
        id: String::new(),
    };
    let entities = states.iter().map(|(v, s)| entity(&run.vehicles[*v], *v, *s, time_ns)).collect();
    SceneUpdate { deletions: vec![everything], entities }
}

fn entity(vehicle: &RecordedVehicle, index: usize, at: usize, time_ns: i64) -> SceneEntity {
    let state = &vehicle.states[at];
    let [length, width, height] = vehicle.size_m;
    // The origin of a vehicle is on the road below the centre of its body, z up.
    let up = |z: f64| state.world_from_vehicle.rotation_matrix() * Vector3::new(0.0, 0.0, z);
    let raised = |z: f64| {
        let mut pose = pose(&state.world_from_vehicle);
        let at = state.world_from_vehicle.translation() + up(z);
        pose.position = Some(super::convert::vector(&at));
        pose
    };
    let cube = CubePrimitive {
        pose: Some(raised(0.5 * height)),
        size: Some(messages::Vector3 { x: length, y: width, z: height }),
        color: Some(colour::of(index, vehicle, if state.predicted { 0.25 } else { 0.6 })),
    };
    let text = TextPrimitive {
        pose: Some(raised(height + 0.6)),
        billboard: true,
        font_size: 0.8,
        scale_invariant: false,
        color: Some(colour::of(index, vehicle, 1.0)),
        text: label(vehicle, state),
    };
    SceneEntity {
        timestamp: Some(timestamp(time_ns)),
        frame_id: WORLD.into(),
        id: vehicle.id.to_string(),
        // Until the next update, which takes all away.
        lifetime: Some(Duration::new(0, 0)),
        metadata: metadata(vehicle, state),
        cubes: vec![cube],
        lines: way(vehicle, index, at),
        texts: vec![text],
        ..SceneEntity::default()
    }
}

fn metadata(vehicle: &RecordedVehicle, state: &RecordedState) -> Vec<KeyValuePair> {
    let [forward, left, up] = state.sigma_m;
    [
        ("class", vehicle.class.clone()),
        ("p_moving", vehicle.p_moving.to_string()),
        ("speed_mps", state.speed_mps.to_string()),
        ("sigma_forward_m", forward.to_string()),
        ("sigma_left_m", left.to_string()),
        ("sigma_up_m", up.to_string()),
        ("predicted", state.predicted.to_string()),
    ]
    .map(|(key, value)| KeyValuePair { key: key.into(), value })
    .to_vec()
}

/// The way of a moving vehicle so far.
fn way(vehicle: &RecordedVehicle, index: usize, last: usize) -> Vec<LinePrimitive> {
    if vehicle.p_moving <= MOVING || last == 0 {
        return Vec::new();
    }
    let point = |state: &RecordedState| {
        let at = state.world_from_vehicle.translation();
        Point3 { x: at.x, y: at.y, z: at.z }
    };
    let line = LinePrimitive {
        r#type: Type::LineStrip.into(),
        pose: Some(pose(&Pose::<World, World>::identity())),
        thickness: 2.0,
        scale_invariant: true,
        points: vehicle.states.iter().take(last + 1).map(point).collect(),
        color: Some(colour::of(index, vehicle, 1.0)),
        ..LinePrimitive::default()
    };
    vec![line]
}
