//! A real drive in synthetic scenery.

use std::collections::BTreeMap;

use motorcade_dataset::{Cam0, Label};
use motorcade_geometry::{Camera, Pose, World};
use motorcade_perception::VehicleClass;
use motorcade_vehicles::Dimensions;
use nalgebra::{Matrix3, Point2, Point3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drive::Drive;
use crate::error::{Error, Result};
use crate::form::body_type;
use crate::motion::{Road, averaged, every_metre};
use crate::options::DetectorOptions;
use crate::options::RenderOptions;
use crate::plan::Staging;
use crate::route::LANE_M;
use crate::scenery::kerb_height_m;
use crate::simulate::{MARGIN_M, standing};
use crate::site::Site;
use crate::vehicle::{Body, SimulatedVehicle, draw_colour};

/// Options of a reenactment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReenactOptions {
    /// Height of the camera above the road \[m\].
    pub height_m: f64,
    /// Distance from the centre line to the kerb \[m\]; the camera drives in the right lane.
    pub half_width_m: f64,
    /// Frame number, in the labels, of the first pose.
    pub first_frame: u64,
    /// Seed of scenery, colours and noise.
    pub seed: u64,
}

impl Default for ReenactOptions {
    fn default() -> Self {
        Self { height_m: 1.65, half_width_m: 5.6, first_frame: 0, seed: 0 }
    }
}

/// Labels of camera 0 in another camera of the rig. Rectified cameras differ by a shift alone, so headings are equal.
pub fn labels_in_camera(labels: &[Label], camera_from_cam0: &Pose<Camera, Cam0>) -> Vec<Label> {
    let moved = |label: &Label| {
        let place = camera_from_cam0.transform_point(&Point3::from(label.location_m));
        Label { location_m: place.coords.into(), ..label.clone() }
    };
    labels.iter().map(moved).collect()
}

/// Drive with the given camera poses and with vehicles at their labels (KITTI's conventions, in the frame of the given
/// poses), on a road fitted below the camera's path. Vehicles keep position, heading and size; their heights are the road's.
///
/// # Errors
/// No poses, or a path that a camera cannot have taken.
pub fn reenact(
    name: &str,
    world_from_camera: &[Pose<World, Camera>],
    labels: &[Label],
    options: &ReenactOptions,
    render: &RenderOptions,
) -> Result<Drive> {
    render.validate()?;
    if !world_from_camera.iter().all(Pose::is_finite) {
        return Err(Error::Plan("the trajectory holds poses that are not finite".into()));
    }
    let Some(first) = world_from_camera.first() else {
        return Err(Error::Plan("the trajectory holds no poses".into()));
    };
    // The first camera is assumed level: its tilt becomes a slope of the road.
    let level = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let site_from_world: Pose<Site, World> =
        Pose::<Site, Camera>::from_matrix(&level, &Vector3::zeros()) * first.inverse();
    let site_from_camera: Vec<Pose<Site, Camera>> =
        world_from_camera.iter().map(|p| site_from_world * *p).collect();
    let road = road_below(&site_from_camera, options);
    let vehicles = vehicles(&site_from_camera, labels, &road, options, render.fps);
    Ok(Drive {
        name: name.to_owned(),
        seed: options.seed,
        traffic_seed: options.seed,
        first_visit: None,
        render: *render,
        detector: DetectorOptions::default(),
        road,
        site_from_camera,
        vehicles,
        staging: Staging::default(),
    })
}

/// The road below the camera's path: points a metre apart, smoothed, moved to the middle of the road.
fn road_below(site_from_camera: &[Pose<Site, Camera>], options: &ReenactOptions) -> Road {
    let mut way: Vec<Point3<f64>> = Vec::new();
    for pose in site_from_camera {
        let below = Point3::from(pose.translation() - Vector3::z() * options.height_m);
        // The poses of a standing camera jitter.
        if way.last().is_none_or(|last| (below - last).xy().norm() > 1.5) {
            way.push(below);
        }
    }
    let extended = extended(way);
    let dense = every_metre(&extended);
    let smooth = (0..3).fold(dense, |points, _| averaged(&points));
    let shifted: Vec<Point3<f64>> = (0..smooth.len())
        .map(|i| {
            let ahead = smooth[(i + 1).min(smooth.len() - 1)] - smooth[i.saturating_sub(1)];
            smooth[i] + Vector3::new(-ahead.y, ahead.x, 0.0).normalize() * LANE_M
        })
        .collect();
    Road::through(&every_metre(&shifted), options.half_width_m)
}

/// Extended straight before the start and after the end.
fn extended(way: Vec<Point3<f64>>) -> Vec<Point3<f64>> {
    let direction = |from: Option<&Point3<f64>>, to: Option<&Point3<f64>>| match (from, to) {
        (Some(a), Some(b)) if (b - a).xy().norm() > 1.0 => (b - a) / (b - a).xy().norm(),
        _ => Vector3::x(),
    };
    // Direction over several points, so that the noise of one does not turn the road.
    let reach = 5.min(way.len().saturating_sub(1));
    let begin = direction(way.first(), way.get(reach));
    let end = direction(way.get(way.len() - 1 - reach), way.last());
    let head = way.first().map(|p| p - begin * MARGIN_M.0);
    let tail = way.last().map(|p| p + end * MARGIN_M.1);
    head.into_iter().chain(way).chain(tail).collect()
}

fn vehicles(
    site_from_camera: &[Pose<Site, Camera>],
    labels: &[Label],
    road: &Road,
    options: &ReenactOptions,
    fps: f64,
) -> Vec<SimulatedVehicle> {
    let mut tracks: BTreeMap<i64, Vec<(usize, VehicleClass, &Label)>> = BTreeMap::new();
    for label in labels.iter().filter(|l| l.track >= 0) {
        let Some(frame) = label.frame.checked_sub(options.first_frame).map(|f| f as usize) else { continue };
        if let Ok(class) = label.class.parse::<VehicleClass>()
            && frame < site_from_camera.len()
        {
            tracks.entry(label.track).or_default().push((frame, class, label));
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut out = Vec::new();
    for (id, track) in tracks {
        let Some(&(_, class, label)) = track.first() else { continue };
        let [height_m, width_m, length_m] = label.size_hwl_m;
        let mut poses = vec![None; site_from_camera.len()];
        for (frame, _, label) in track {
            let camera = &site_from_camera[frame];
            let centre = camera.transform_point(&Point3::from(Vector3::from(label.location_m)));
            let nose = camera.transform_vector(&Vector3::new(label.ry_rad.cos(), 0.0, -label.ry_rad.sin()));
            let centre = Point2::new(centre.x, centre.y);
            let mut pose = standing(road, &centre, nose.y.atan2(nose.x));
            let (s, d) = road.locate(&centre);
            if d.abs() > road.half_width_m {
                let lift = Vector3::z() * kerb_height_m(road, s);
                pose = Pose::from_parts(pose.rotation(), pose.translation() + lift);
            }
            poses[frame] = Some(pose);
        }
        let speeds_m_s = speeds(&poses, fps);
        let size = Dimensions { length_m, width_m, height_m };
        let body_type = body_type(class, &size, rng.random());
        let colour = draw_colour(class, &mut rng);
        out.push(SimulatedVehicle {
            id: id as u32,
            class,
            size,
            body_type,
            blueprint: None,
            body: Body::Usual,
            colour,
            poses,
            speeds_m_s,
        });
    }
    out
}

/// Speeds by differences of neighbouring positions \[m/s\]; 0 where a vehicle has none.
fn speeds(poses: &[Option<Pose<Site, motorcade_geometry::Vehicle>>], fps: f64) -> Vec<f64> {
    let at = |i: usize| poses.get(i).copied().flatten();
    let between = |a: usize, b: usize| {
        Some((at(b)?.translation() - at(a)?.translation()).norm() * fps / (b - a) as f64)
    };
    let one = |i: usize| {
        let before = i.checked_sub(1).filter(|k| at(*k).is_some()).unwrap_or(i);
        let after = if at(i + 1).is_some() { i + 1 } else { i };
        if before < after { between(before, after).unwrap_or(0.0) } else { 0.0 }
    };
    (0..poses.len()).map(one).collect()
}
