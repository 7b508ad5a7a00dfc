//! A run as the vehicles of a scenario.

use motorcade::RecordedRun;
use motorcade_geometry::{Pose, World};
use nalgebra::{Matrix3, Vector3};

use crate::anchor::Placed;

/// Shapes of the vehicles that a simulator is told and nobody measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenarioOptions {
    /// Length, width and height of the car that carries the camera: a middle-sized one \[m\].
    pub own_size_m: [f64; 3],
    /// Distance from the rear axle to the camera in it, as a share of the wheelbase: behind the windscreen.
    pub camera_share: f64,
    /// Wheelbase of road vehicles as a share of their length.
    pub wheelbase_share: f64,
}

impl Default for ScenarioOptions {
    fn default() -> Self {
        Self { own_size_m: [4.5, 1.8, 1.5], camera_share: 0.6, wheelbase_share: 0.6 }
    }
}

/// A drive to be replayed.
pub struct Scenario {
    /// The camera's own vehicle first.
    pub(crate) actors: Vec<Actor>,
    /// Time of the first frame (RFC 3339), or the start of 1970 where it is not known.
    pub(crate) date: String,
    /// Time of the last frame from the first \[s\].
    pub(crate) end_s: f64,
}

/// A vehicle.
pub(crate) struct Actor {
    pub name: String,
    /// OpenSCENARIO's vehicle category.
    pub category: &'static str,
    /// Length, width, height \[m\].
    pub size_m: [f64; 3],
    /// Distance between the axles \[m\].
    pub wheelbase_m: f64,
    pub poses: Vec<ActorPose>,
}

/// A vehicle at a time.
pub(crate) struct ActorPose {
    /// From the first frame \[s\].
    pub time_s: f64,
    /// The rear axle on the road, east, north, up from the road under the first camera \[m\].
    pub rear_axle_m: Vector3<f64>,
    /// From east counter-clockwise; nose down positive; left side up positive \[rad\].
    pub heading_pitch_roll_rad: [f64; 3],
}

impl Actor {
    /// The middle of the box ahead of the rear axle: overhangs are taken to be equal.
    pub fn centre_x_m(&self) -> f64 {
        0.5 * self.wheelbase_m
    }

    /// Larger wheels on larger vehicles \[m\].
    pub fn wheel_m(&self) -> f64 {
        if self.size_m[2] > 2.2 { 1.0 } else { 0.65 }
    }

    pub fn starts_s(&self) -> f64 {
        self.poses.first().map_or(0.0, |p| p.time_s)
    }

    pub fn ends_s(&self) -> f64 {
        self.poses.last().map_or(0.0, |p| p.time_s)
    }
}

impl Scenario {
    /// The vehicles of a run in its place; `height_m` is that of the camera above the road.
    pub fn new(placed: &Placed<'_>, height_m: f64, options: &ScenarioOptions) -> Self {
        let run = placed.run;
        let start_ns = run.frames.first().map_or(0, |f| f.timestamp_ns);
        let seconds = |row: usize| run.frames.get(row).map(|f| (f.timestamp_ns - start_ns) as f64 * 1e-9);
        let down = Vector3::new(0.0, 0.0, height_m);
        let mut actors = vec![own(placed, height_m, options)];
        for vehicle in &run.vehicles {
            let mut actor = Actor {
                name: format!("{} {}", vehicle.class, vehicle.id),
                category: category(&vehicle.class),
                size_m: vehicle.size_m,
                wheelbase_m: options.wheelbase_share * vehicle.size_m[0],
                poses: Vec::new(),
            };
            let behind = Vector3::new(actor.centre_x_m(), 0.0, 0.0);
            actor.poses = vehicle
                .states
                .iter()
                .filter_map(|state| {
                    let pose = &state.world_from_vehicle;
                    let rear = pose.translation() - pose.rotation_matrix() * behind;
                    Some(ActorPose {
                        time_s: seconds(state.row)?,
                        rear_axle_m: placed.local(&rear) + down,
                        heading_pitch_roll_rad: angles(&body_axes(placed, pose)),
                    })
                })
                .collect();
            actors.push(actor);
        }
        actors.retain(|a| !a.poses.is_empty());
        let date = placed.utc(start_ns).unwrap_or_else(|| "1970-01-01T00:00:00.000Z".to_owned());
        Self { actors, date, end_s: run.frames.len().checked_sub(1).and_then(seconds).unwrap_or(0.0) }
    }
}

/// The car with the camera: its axes are those of the road under it.
fn own(placed: &Placed<'_>, height_m: f64, options: &ScenarioOptions) -> Actor {
    let run: &RecordedRun = placed.run;
    let start_ns = run.frames.first().map_or(0, |f| f.timestamp_ns);
    let (size_m, wheelbase_m) = (options.own_size_m, options.wheelbase_share * options.own_size_m[0]);
    let mut own = Actor { name: "ego".into(), category: "car", size_m, wheelbase_m, poses: Vec::new() };
    let ahead = options.camera_share * wheelbase_m;
    let down = Vector3::new(0.0, 0.0, height_m);
    own.poses = run
        .frames
        .iter()
        .filter_map(|frame| {
            let pose = &frame.world_from_camera;
            let up = placed.direction(pose, &frame.road_normal);
            let view = placed.direction(pose, &Vector3::z());
            let forward = (view - up * view.dot(&up)).try_normalize(1e-6)?;
            let under = placed.local(&pose.translation()) - up * height_m;
            Some(ActorPose {
                time_s: (frame.timestamp_ns - start_ns) as f64 * 1e-9,
                rear_axle_m: under - forward * ahead + down,
                heading_pitch_roll_rad: angles(&Matrix3::from_columns(&[forward, up.cross(&forward), up])),
            })
        })
        .collect();
    own
}

/// Forward, left and up of a vehicle as columns, east, north, up.
fn body_axes<F>(placed: &Placed<'_>, pose: &Pose<World, F>) -> Matrix3<f64> {
    Matrix3::from_columns(
        &[Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| placed.direction(pose, &axis)),
    )
}

/// Heading, pitch and roll (about z, then y, then x).
fn angles(axes: &Matrix3<f64>) -> [f64; 3] {
    let heading = axes[(1, 0)].atan2(axes[(0, 0)]);
    let pitch = (-axes[(2, 0)]).clamp(-1.0, 1.0).asin();
    let roll = axes[(2, 1)].atan2(axes[(2, 2)]);
    [heading, pitch, roll]
}

/// OpenSCENARIO's category of a class.
fn category(class: &str) -> &'static str {
    match class {
        "Bus" => "bus",
        "Truck" => "truck",
        "Van" => "van",
        "Motorcycle" => "motorbike",
        _ => "car",
    }
}
