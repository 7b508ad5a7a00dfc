//! From a plan to a drive.

use std::sync::Arc;

use motorcade_geometry::{Camera, Pose, Vehicle};
use motorcade_perception::VehicleClass;
use nalgebra::{Matrix3, Point2, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drive::Drive;
use crate::error::{Error, Result};
use crate::form::{Form, body_type};
use crate::motion::{Axles, PlanarState, Road, follow, tow};
use crate::options::RenderOptions;
use crate::plan::{Driver, Plan, Rig, Route, Side};
use crate::route::{self, PARKING_INSET_M};
use crate::scenario::Scenario;
use crate::site::Site;
use crate::trailer::TrailerKind;
use crate::vehicle::{Body, SimulatedVehicle, draw_colour, draw_size};

/// Road before the start and after the end of the camera's path \[m\]: its ends must be out of sight.
pub(crate) const MARGIN_M: (f64, f64) = (70.0, 260.0);

/// Simulates a scenario for a number of frames. The same seed gives the same drive.
///
/// # Errors
/// No frames, an invalid camera, or a route over a crossing that the road does not have.
pub fn simulate(scenario: &Scenario, frames: usize, seed: u64, render: &RenderOptions) -> Result<Drive> {
    driven(scenario, &scenario.plan, frames, (seed, seed), render)
}

/// Another visit of the streets that [`simulate`] drives with the seed `streets`: traffic, parked cars, suspension, speed and noise come
/// from `traffic`, and the camera starts elsewhere and keeps another distance to the kerb.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_again(
    scenario: &Scenario,
    frames: usize,
    (streets, traffic): (u64, u64),
    render: &RenderOptions,
) -> Result<Drive> {
    let first = simulate(scenario, frames, streets, render)?;
    let plan = scenario.plan.another_visit(traffic);
    let again = driven(scenario, &plan, frames, (streets, traffic), render)?;
    Ok(Drive { first_visit: Some(Arc::new(first)), ..again })
}

fn driven(
    scenario: &Scenario,
    plan: &Plan,
    frames: usize,
    (seed, traffic_seed): (u64, u64),
    render: &RenderOptions,
) -> Result<Drive> {
    render.validate()?;
    if frames == 0 {
        return Err(Error::Plan("a drive needs at least one frame".into()));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(traffic_seed);
    let distance_m = plan.ego_speed.distance_m(frames as f64 / render.fps);
    let road = Road::build(&plan.road, -MARGIN_M.0, distance_m + MARGIN_M.1);

    let ego_axles = Axles { wheelbase_m: 2.7, rear_to_centre_m: 1.3 };
    let (path, start_m) = route::path(&road, &plan.ego_route, 1.8)?;
    let states = follow(&path, start_m, ego_axles, &plan.ego_speed, frames, render.fps);
    let suspension = Suspension::new(&mut rng);
    let site_from_camera = states
        .iter()
        .enumerate()
        .map(|(i, s)| {
            let time_s = i as f64 / render.fps;
            standing(&road, &s.centre, s.heading_rad)
                * suspension.vehicle_from_camera(&plan.rig, time_s, s.speed_m_s)
        })
        .collect();

    let mut vehicles = Vec::new();
    for driver in plan.drivers.iter().cloned().chain(parked(plan, &road, &mut rng)) {
        let vehicle = drive(&road, &driver, vehicles.len() as u32, frames, render.fps, &mut rng)?;
        let trailer = match driver.towing {
            Some(kind) => Some(trailer(&road, &driver, (&vehicle, kind), frames, render.fps, &mut rng)?),
            None => None,
        };
        vehicles.push(vehicle);
        vehicles.extend(trailer);
    }
    Ok(Drive {
        name: scenario.name.clone(),
        seed,
        traffic_seed,
        first_visit: None,
        render: *render,
        detector: scenario.detector,
        road,
        site_from_camera,
        vehicles,
        staging: plan.staging.clone(),
    })
}

fn drive(
    road: &Road,
    driver: &Driver,
    id: u32,
    frames: usize,
    fps: f64,
    rng: &mut ChaCha8Rng,
) -> Result<SimulatedVehicle> {
    let drawn = draw_size(driver.class, rng);
    let size = driver.towing.and_then(TrailerKind::towing_size).unwrap_or(drawn);
    let body_type = body_type(driver.class, &size, rng.random());
    let (form, colour) = (Form::of(driver.class, body_type, &size), draw_colour(driver.class, rng));
    let place = match driver.route {
        Route::Parked { s_m, side } => {
            let d = side.sign()
                * (road.half_width_m - PARKING_INSET_M - 0.5 * size.width_m + rng.random_range(-0.08..0.08));
            let turned = if side == Side::Left { std::f64::consts::PI } else { 0.0 };
            Some((s_m, d, turned + rng.random_range(-0.02..0.02)))
        }
        Route::Standing { s_m, d_m, turned_rad } => {
            Some((s_m, d_m + rng.random_range(-0.12..0.12), turned_rad + rng.random_range(-0.03..0.03)))
        }
        _ => None,
    };
    let states = match place {
        Some((s_m, d_m, turned_rad)) => {
            let heading_rad = road.at(s_m).heading_rad + turned_rad;
            vec![PlanarState { centre: road.point(s_m, d_m).xy(), heading_rad, speed_m_s: 0.0 }; frames]
        }
        None => {
            let (path, start_m) = route::path(road, &driver.route, size.width_m)?;
            follow(&path, start_m, axles(&form, size.length_m), &driver.speed, frames, fps)
        }
    };
    let (poses, speeds_m_s) = on_road(road, &states);
    Ok(SimulatedVehicle {
        id,
        class: driver.class,
        size,
        body_type,
        blueprint: None,
        body: if driver.towing.is_some_and(|t| t.towing_size().is_some()) {
            Body::Tractor
        } else {
            Body::Usual
        },
        colour,
        poses,
        speeds_m_s,
    })
}

fn axles(form: &Form, length_m: f64) -> Axles {
    Axles {
        wheelbase_m: (form.front_axle - form.rear_axle) * length_m,
        rear_to_centre_m: -form.rear_axle * length_m,
    }
}

/// Poses and speeds of states \[m/s\].
fn on_road(road: &Road, states: &[PlanarState]) -> (Vec<Option<Pose<Site, Vehicle>>>, Vec<f64>) {
    let pose = |s: &PlanarState| Some(standing(road, &s.centre, s.heading_rad));
    (states.iter().map(pose).collect(), states.iter().map(|s| s.speed_m_s).collect())
}

/// The trailer of a driver's vehicle; in its first frame its axle is on the path.
fn trailer(
    road: &Road,
    driver: &Driver,
    (towing, kind): (&SimulatedVehicle, TrailerKind),
    frames: usize,
    fps: f64,
    rng: &mut ChaCha8Rng,
) -> Result<SimulatedVehicle> {
    // The steps of the towing vehicle's own motion: a trailer is integrated along them.
    const STEPS_PER_S: f64 = 100.0;
    let steps = (STEPS_PER_S / fps).round().max(1.0) as usize;
    let form = towing.form();
    let (path, start_m) = route::path(road, &driver.route, towing.size.width_m)?;
    let motion = axles(&form, towing.size.length_m);
    let count = frames.saturating_sub(1) * steps + 1;
    let leading = follow(&path, start_m, motion, &driver.speed, count, fps * steps as f64);
    let hitch = kind.hitch(towing.size.length_m, &form);
    let axle = path.at(start_m + hitch.ahead_m - hitch.to_axle_m).0;
    let states: Vec<PlanarState> = tow(&leading, &hitch, axle).into_iter().step_by(steps).collect();
    let (poses, speeds_m_s) = on_road(road, &states);
    let class = kind.detected_as();
    Ok(SimulatedVehicle {
        id: towing.id + 1,
        class,
        size: kind.size(),
        body_type: None,
        blueprint: None,
        body: Body::Trailer { kind, towed_by: towing.id },
        colour: draw_colour(class, rng),
        poses,
        speeds_m_s,
    })
}

/// Random parked cars, away from planned ones and from crossings.
fn parked(plan: &Plan, road: &Road, rng: &mut ChaCha8Rng) -> Vec<Driver> {
    const PITCH_M: f64 = 7.0;
    let mut drivers = Vec::new();
    if plan.parked_chance <= 0.0 {
        return drivers;
    }
    let (from, to) = road.extent_m();
    for i in 0..((to - from) / PITCH_M) as usize {
        for side in [Side::Left, Side::Right] {
            let s_m = from + (i as f64 + 0.5) * PITCH_M + rng.random_range(-0.6..0.6);
            let class = if rng.random_bool(0.12) { VehicleClass::Van } else { VehicleClass::Car };
            let taken = rng.random_bool(plan.parked_chance);
            let free = plan.drivers.iter().all(|d| match d.route {
                Route::Parked { s_m: other, side: on } => on != side || (other - s_m).abs() > PITCH_M,
                _ => true,
            });
            if taken && free && road.to_crossing_m(s_m) > 14.0 && !near_other_stretch(road, s_m, side) {
                let speed = crate::motion::SpeedPlan::constant(0.0);
                drivers.push(Driver { class, route: Route::Parked { s_m, side }, speed, towing: None });
            }
        }
    }
    drivers
}

/// True where a car parked at `s_m` would stand on, or before the mouth of, another street of a way through a town.
fn near_other_stretch(road: &Road, s_m: f64, side: Side) -> bool {
    let d = side.sign() * road.half_width_m;
    let mouth = |ahead_m: f64| {
        let (_, found) = road.locate(&road.point(s_m + ahead_m, d).xy());
        found.abs() < road.half_width_m - 0.1
    };
    road.is_again(s_m) || road.drives_again() && [-8.0, 0.0, 8.0].into_iter().any(mouth)
}

/// `site_from_vehicle` of a vehicle that stands on the road with its body centre over a point.
pub(crate) fn standing(road: &Road, centre: &Point2<f64>, heading_rad: f64) -> Pose<Site, Vehicle> {
    let (z, gradient) = road.surface(centre);
    let (forward, left) = crate::motion::axes(heading_rad);
    let lifted = |v: nalgebra::Vector2<f64>| Vector3::new(v.x, v.y, gradient.dot(&v));
    let x = lifted(forward).normalize();
    let z_axis = x.cross(&lifted(left)).normalize();
    let rotation = Matrix3::from_columns(&[x, z_axis.cross(&x), z_axis]);
    Pose::from_matrix(&rotation, &Vector3::new(centre.x, centre.y, z))
}

/// Oscillation of the suspension: two near frequencies, so that it does not repeat within a drive.
struct Suspension {
    phases: [f64; 4],
}

impl Suspension {
    fn new(rng: &mut ChaCha8Rng) -> Self {
        Self { phases: std::array::from_fn(|_| rng.random_range(0.0..std::f64::consts::TAU)) }
    }

    fn vehicle_from_camera(&self, rig: &Rig, time_s: f64, speed_m_s: f64) -> Pose<Vehicle, Camera> {
        let wave = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * time_s + phase).sin();
        let hz = rig.oscillation_hz;
        // A standing car does not rock.
        let amplitude = rig.oscillation_rad * (speed_m_s / 5.0).clamp(0.0, 1.0);
        let pitch = rig.pitch_rad
            + amplitude * (0.7 * wave(hz, self.phases[0]) + 0.5 * wave(0.62 * hz, self.phases[1]));
        let roll = rig.roll_rad + 0.5 * amplitude * wave(0.8 * hz, self.phases[2]);
        // 0.2 degrees of pitch go with about 8 mm of heave.
        let heave_m = 2.3 * amplitude * wave(0.9 * hz, self.phases[3]);
        // Columns: camera x, y, z in the vehicle frame.
        let level = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        let tilt = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), -pitch)
            * nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), roll);
        let rotation = level * tilt.into_inner();
        Pose::from_matrix(&rotation, &Vector3::new(0.3, 0.0, rig.height_m + heave_m))
    }
}
