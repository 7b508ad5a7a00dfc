//! Vehicles in the world, as `visualization_msgs/MarkerArray`.

use motorcade::{RecordedRun, RecordedState, RecordedVehicle};
use motorcade_geometry::{Pose, Vehicle, World};
use motorcade_viewer::{MOVING, hue, rgb};
use nalgebra::Vector3;

use super::cdr::Cdr;
use super::parts::{header, pose, vector};
use crate::frames::WORLD;
use crate::label::label;

/// Kinds of markers, and what is done with them.
const CUBE: i32 = 1;
const LINE_STRIP: i32 = 4;
const TEXT: i32 = 9;
const ADD: i32 = 0;
const DELETE_ALL: i32 = 3;

/// Height of labels and width of lines \[m\].
const LABEL_M: f64 = 0.8;
const LINE_M: f64 = 0.1;

/// A marker; what is not said is empty.
struct Marker<'a> {
    namespace: &'a str,
    id: i32,
    kind: i32,
    action: i32,
    pose: Pose<World, Vehicle>,
    scale: Vector3<f64>,
    colour: [f64; 4],
    points: &'a [Vector3<f64>],
    text: &'a str,
}

impl Marker<'_> {
    fn write(&self, out: &mut Cdr, time_ns: i64) {
        header(out, time_ns, WORLD);
        out.text(self.namespace);
        out.i32(self.id);
        out.i32(self.kind);
        out.i32(self.action);
        pose(out, &self.pose);
        vector(out, &self.scale);
        self.colour.iter().for_each(|channel| out.f32(*channel as f32));
        // Lifetime: until the next message, which takes all away.
        out.i32(0);
        out.u32(0);
        out.bool(false);
        out.length(self.points.len());
        self.points.iter().for_each(|point| vector(out, point));
        out.length(0);
        // No texture: its name, picture and coordinates.
        out.text("");
        header(out, 0, "");
        out.text("");
        out.bytes(&[]);
        out.length(0);
        out.text(self.text);
        // No mesh: its name, file and materials.
        out.text("");
        out.text("");
        out.bytes(&[]);
        out.bool(false);
    }
}

/// The vehicles of a frame in place of those of the frame before. `states`: index of the vehicle and of its state.
pub(crate) fn markers(run: &RecordedRun, time_ns: i64, states: &[(usize, usize)]) -> Cdr {
    let (mut body, mut count) = (Cdr::new(), 1);
    // The length stands before the markers and is known after them; a marker may have a line or none.
    let found: Vec<_> = states
        .iter()
        .filter_map(|(v, s)| {
            let vehicle = run.vehicles.get(*v)?;
            Some((*v, vehicle, *s, vehicle.states.get(*s)?))
        })
        .collect();
    count += found.iter().map(|(_, vehicle, s, _)| 2 + usize::from(has_way(vehicle, *s))).sum::<usize>();
    body.length(count);
    let nothing = Marker {
        namespace: "",
        id: 0,
        kind: 0,
        action: DELETE_ALL,
        pose: Pose::identity(),
        scale: Vector3::zeros(),
        colour: [0.0; 4],
        points: &[],
        text: "",
    };
    nothing.write(&mut body, time_ns);
    for (index, vehicle, s, state) in found {
        vehicle_markers(&mut body, time_ns, vehicle, index, s, state);
    }
    body
}

fn has_way(vehicle: &RecordedVehicle, at: usize) -> bool {
    vehicle.p_moving > MOVING && at > 0
}

fn vehicle_markers(
    out: &mut Cdr,
    time_ns: i64,
    vehicle: &RecordedVehicle,
    index: usize,
    at: usize,
    state: &RecordedState,
) {
    let [length, width, height] = vehicle.size_m;
    let [r, g, b] = rgb(hue(index), vehicle.p_moving > MOVING);
    // The origin of a vehicle is on the road below the centre of its body, z up.
    let raised = |z: f64| {
        let up = state.world_from_vehicle.rotation_matrix() * Vector3::new(0.0, 0.0, z);
        Pose::from_parts(state.world_from_vehicle.rotation(), state.world_from_vehicle.translation() + up)
    };
    let body = Marker {
        namespace: "body",
        id: i32::try_from(vehicle.id).unwrap_or(i32::MAX),
        kind: CUBE,
        action: ADD,
        pose: raised(0.5 * height),
        scale: Vector3::new(length, width, height),
        colour: [r, g, b, if state.predicted { 0.25 } else { 0.6 }],
        points: &[],
        text: "",
    };
    body.write(out, time_ns);
    let text = label(vehicle, state);
    let name = Marker {
        namespace: "label",
        kind: TEXT,
        pose: raised(height + 0.6),
        scale: Vector3::new(0.0, 0.0, LABEL_M),
        colour: [r, g, b, 1.0],
        text: &text,
        ..body
    };
    name.write(out, time_ns);
    if has_way(vehicle, at) {
        let points: Vec<_> =
            vehicle.states.iter().take(at + 1).map(|s| s.world_from_vehicle.translation()).collect();
        let way = Marker {
            namespace: "way",
            kind: LINE_STRIP,
            pose: Pose::identity(),
            scale: Vector3::new(LINE_M, 0.0, 0.0),
            text: "",
            points: &points,
            ..name
        };
        way.write(out, time_ns);
    }
}
