//! A short street full of vehicles, with cameras that each have one of them as target.

use motorcade_geometry::{Camera, PinholeCamera, Pose};
use motorcade_perception::VehicleClass;
use nalgebra::{Point2, Vector2};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::fleet::Model;
use super::viewpoint::{self, Viewpoint};
use crate::drive::Drive;
use crate::hash;
use crate::mesh::Chunk;
use crate::motion::{Bend, Grade, Road, RoadKind, RoadPlan};
use crate::options::DetectorOptions;
use crate::options::{Look, RenderOptions, SensorOptions};
use crate::plan::Staging;
use crate::scenery;
use crate::simulate::standing;
use crate::site::Site;
use crate::vehicle::{Body, SimulatedVehicle};
use crate::weather::Weather;

/// Views of one street.
const VIEWS: usize = 24;
/// Vehicles present in one view only, in turn: in front of its target or behind it.
const EXTRAS: usize = 6;
/// Range of `s` with vehicles \[m\].
const EXTENT_M: (f64, f64) = (-30.0, 110.0);

/// A view of a street; its index is that of the frame of the drive.
#[derive(Clone, Debug)]
pub(super) struct View {
    /// Index of the target vehicle.
    pub target: usize,
    /// The whole picture.
    pub camera: PinholeCamera,
}

pub(super) struct Street {
    pub drive: Drive,
    pub views: Vec<View>,
    /// Label of each vehicle's body.
    pub labels: Vec<usize>,
    /// Posts in front of vehicles.
    pub posts: Vec<Chunk>,
}

impl Street {
    /// The street with a number; the same seed and number give the same street.
    pub(super) fn draw(seed: u64, number: u64) -> Self {
        let seed = hash::mix(seed ^ hash::mix(number ^ 0x57ee7));
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let road = road(&mut rng);
        let (mut vehicles, mut labels) = parked_and_driving(&road, &mut rng);
        let viewpoints: Vec<(usize, Viewpoint)> = (0..VIEWS)
            .filter_map(|_| {
                let target = rng.random_range(0..vehicles.len().max(1));
                Some((target, viewpoint::viewpoint_of(&road, &vehicles, target, &mut rng)?))
            })
            .collect();
        let poses: Vec<Pose<Site, Camera>> =
            viewpoints.iter().map(|(_, viewpoint)| viewpoint.site_from_camera).collect();
        for vehicle in &mut vehicles {
            vehicle.poses.resize(poses.len(), vehicle.poses.first().copied().flatten());
        }
        let mut posts = Vec::new();
        for _ in 0..EXTRAS {
            let id = vehicles.len();
            let (vehicle, label) = vehicle(id, &mut rng);
            vehicles.push(SimulatedVehicle { poses: vec![None; poses.len()], ..vehicle });
            labels.push(label);
        }
        for (view, (target, viewpoint)) in viewpoints.iter().enumerate() {
            let extra = vehicles.len() - EXTRAS + view % EXTRAS;
            place_extra(&road, &mut vehicles, (view, extra, *target), viewpoint, &mut rng);
            if rng.random_bool(0.22) {
                posts.extend(post(&vehicles, view, *target, viewpoint, &mut rng));
            }
        }
        let views = viewpoints
            .into_iter()
            .map(|(target, viewpoint)| View { target, camera: viewpoint.camera })
            .collect();
        let weather = match rng.random_range(0..10) {
            0..6 => Weather::Clear,
            6..9 => Weather::Overcast,
            _ => Weather::Rain,
        };
        let render = RenderOptions {
            weather,
            sensor: SensorOptions { noise: 0.0, exposure_drift: 0.0, ..SensorOptions::default() },
            look: Look::Varied,
            ..RenderOptions::default()
        };
        let detector = DetectorOptions::default();
        let name = "training".to_owned();
        let drive = Drive {
            name,
            seed,
            traffic_seed: seed,
            first_visit: None,
            render,
            detector,
            road,
            site_from_camera: poses,
            vehicles,
            staging: Staging::default(),
        };
        Self { drive, views, labels, posts }
    }
}

fn road(rng: &mut ChaCha8Rng) -> Road {
    let curvature_per_m = if rng.random_bool(0.4) { rng.random_range(-0.012..0.012) } else { 0.0 };
    let rise = if rng.random_bool(0.3) { rng.random_range(-0.05..0.05) } else { 0.0 };
    let plan = RoadPlan {
        half_width_m: rng.random_range(3.2..8.5),
        bends: vec![Bend { length_m: 120.0, curvature_per_m }],
        grades: vec![Grade { length_m: 120.0, rise }],
        crossings_m: if rng.random_bool(0.3) { vec![rng.random_range(0.0..80.0)] } else { Vec::new() },
        closed: false,
        corners_m: vec![],
        paved: vec![],
        kind: RoadKind::Street,
    };
    Road::build(&plan, EXTENT_M.0 - 40.0, EXTENT_M.1 + 60.0)
}

fn vehicle(id: usize, rng: &mut ChaCha8Rng) -> (SimulatedVehicle, usize) {
    let Model { class, size, body_type, blueprint, label } = Model::draw(rng);
    let vehicle = SimulatedVehicle {
        id: id as u32,
        class,
        size,
        body_type,
        blueprint,
        body: Body::Usual,
        colour: [0.5; 3],
        poses: Vec::new(),
        speeds_m_s: Vec::new(),
    };
    (vehicle, label)
}

/// Two lanes, two rows at the kerbs, and vehicles in any direction beside the road.
fn parked_and_driving(road: &Road, rng: &mut ChaCha8Rng) -> (Vec<SimulatedVehicle>, Vec<usize>) {
    let (mut vehicles, mut labels) = (Vec::new(), Vec::new());
    let half = road.half_width_m;
    let density: f64 = rng.random_range(0.15..0.8);
    for row in 0..6 {
        // Offset of the row from the centre line, direction of its vehicles, spacing; rows 4 and 5 are on the verge.
        let side = if row % 2 == 0 { -1.0 } else { 1.0 };
        let (d, chance) = match row {
            0 | 1 => (side * (0.45 * half).clamp(1.6, 2.2), 0.5 * density),
            2 | 3 if half > 4.6 => (side * (half - 1.1), density),
            2 | 3 => continue,
            _ => (side * (half + rng.random_range(3.5..7.0)), 0.35 * density),
        };
        let across: f64 = if row >= 4 { rng.random_range(-3.2..3.2) } else { 0.0 };
        let mut s = EXTENT_M.0 + rng.random_range(0.0..6.0);
        while s < EXTENT_M.1 {
            let (mut one, label) = vehicle(vehicles.len(), rng);
            s += 0.5 * one.size.length_m;
            if rng.random_bool(chance) {
                let turned = if d > 0.0 && row < 4 { std::f64::consts::PI } else { 0.0 };
                let odd = if rng.random_bool(0.12) { rng.random_range(-0.6..0.6) } else { 0.0 };
                let heading = road.at(s).heading_rad + turned + across + odd + rng.random_range(-0.04..0.04);
                let off = d + rng.random_range(-0.25..0.25);
                one.poses = vec![Some(standing(road, &road.point(s, off).xy(), heading))];
                vehicles.push(one);
                labels.push(label);
            }
            s += 0.5 * EXTENT_STEP_M.max(vehicles.last().map_or(0.0, |v| v.size.length_m))
                + rng.random_range(0.7..6.0);
        }
    }
    (vehicles, labels)
}

/// Free space for a vehicle to be placed \[m\].
const EXTENT_STEP_M: f64 = 5.0;

/// Puts a vehicle in front of the target or behind it, to occlude a part of it or to clutter the background.
fn place_extra(
    road: &Road,
    vehicles: &mut [SimulatedVehicle],
    (view, extra, target): (usize, usize, usize),
    viewpoint: &Viewpoint,
    rng: &mut ChaCha8Rng,
) {
    let Some((centre, size)) = ground_place(vehicles, view, target) else { return };
    let eye =
        Point2::new(viewpoint.site_from_camera.translation().x, viewpoint.site_from_camera.translation().y);
    let along = centre - eye;
    let distance = along.norm();
    let before = rng.random_bool(0.6);
    let Some(one) = vehicles.get(extra) else { return };
    let room = 0.5 * (size + one.size.length_m) + 0.6;
    let from = 0.5 * one.size.length_m + 1.5;
    let reach = if before { from..distance - room } else { distance + room..distance + room + 15.0 };
    if reach.is_empty() || rng.random_bool(0.45) {
        return;
    }
    let at = rng.random_range(reach);
    let side = Vector2::new(-along.y, along.x) / distance.max(0.1);
    let offset =
        rng.random_range(0.6..2.6) * (at / distance).max(0.5) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let place = eye + along * (at / distance.max(0.1)) + side * offset;
    let heading = if rng.random_bool(0.7) {
        road.at(road.locate(&place).0).heading_rad
            + if rng.random_bool(0.5) { std::f64::consts::PI } else { 0.0 }
    } else {
        rng.random_range(-3.2..3.2)
    };
    let clear = |other: &SimulatedVehicle, other_at: Point2<f64>| {
        (other_at - place).norm() > 0.5 * (other.size.length_m + one.size.length_m) + 0.2
    };
    let free = vehicles
        .iter()
        .enumerate()
        .all(|(i, v)| ground_place(vehicles, view, i).is_none_or(|(at, _)| i == extra || clear(v, at)));
    if !free {
        return;
    }
    let pose = standing(road, &place, heading);
    if let Some(slot) = vehicles.get_mut(extra).and_then(|v| v.poses.get_mut(view)) {
        *slot = Some(pose);
    }
}

/// Level position of a vehicle in a view, and its length.
fn ground_place(vehicles: &[SimulatedVehicle], view: usize, index: usize) -> Option<(Point2<f64>, f64)> {
    let vehicle = vehicles.get(index)?;
    let at = (*vehicle.poses.get(view)?)?.translation();
    Some((Point2::new(at.x, at.y), vehicle.size.length_m))
}

/// A post, bollard or trunk between camera and target.
fn post(
    vehicles: &[SimulatedVehicle],
    view: usize,
    target: usize,
    viewpoint: &Viewpoint,
    rng: &mut ChaCha8Rng,
) -> Option<Chunk> {
    let (centre, length) = ground_place(vehicles, view, target)?;
    let eye = viewpoint.site_from_camera.translation();
    let along = centre - Point2::new(eye.x, eye.y);
    let distance = along.norm();
    let reach = 2.0..distance - 0.5 * length - 0.3;
    if reach.is_empty() || vehicles.get(target)?.class == VehicleClass::Motorcycle {
        return None;
    }
    let at = rng.random_range(reach);
    let side = Vector2::new(-along.y, along.x) / distance;
    let place = Point2::new(eye.x, eye.y)
        + along * (at / distance)
        + side * rng.random_range(-1.6..1.6) * (at / distance);
    let height_m =
        if rng.random_bool(0.25) { rng.random_range(0.6..1.3) } else { rng.random_range(2.5..8.0) };
    let radius_m = rng.random_range(0.025..0.13);
    let grey = rng.random_range(0.1..0.7_f32);
    let colours = [[grey; 3], [grey; 3], [0.5, 0.1, 0.08], [0.24, 0.19, 0.14], [0.75, 0.6, 0.1]];
    let colour = colours[rng.random_range(0..colours.len())];
    let ground = vehicles.get(target)?.poses.get(view)?.as_ref()?.translation().z;
    scenery::pole(nalgebra::Point3::new(place.x, place.y, ground - 0.4), height_m, radius_m, colour)
}
