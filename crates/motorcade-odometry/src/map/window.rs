//! The local map: recent keyframes and the landmarks they share.

use std::collections::VecDeque;

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, triangulate_rays};
use nalgebra::{Point2, Point3, Vector3};

use super::bundle::{BundleOptions, BundleProblem, Length, Sighting};
use super::landmark::Landmark;
use super::road_point::OnRoad;

/// A frame whose pose is optimised together with the landmarks.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// Running number in this segment.
    pub number: usize,
    /// Its pose.
    pub camera_from_world: Pose<Camera, World>,
    /// What the road says of the way to the next keyframe.
    pub road: RoadScale,
    /// The road in its camera's frame, `mᵀX = 1`, once one was seen.
    pub plane: Option<Vector3<f64>>,
}

impl Keyframe {
    /// A keyframe that nobody has yet driven on from.
    pub fn new(number: usize, camera_from_world: Pose<Camera, World>) -> Self {
        Self { number, camera_from_world, road: RoadScale::default(), plane: None }
    }
}

/// The scale of the way between two keyframes, as road measurements on it tell.
#[derive(Clone, Copy, Debug, Default)]
pub struct RoadScale {
    /// Σ w·ln(height measured / height held), Σ w with w = 1/σ².
    sum: f64,
    weight: f64,
    /// Logarithm of the length the road wants, once the next keyframe is there.
    log_length: Option<f64>,
}

impl RoadScale {
    /// Takes the camera height as measured over the height that is held; `sigma` of its logarithm.
    pub fn add(&mut self, log_ratio: f64, sigma: f64) {
        let weight = 1.0 / (sigma * sigma);
        self.sum += weight * log_ratio;
        self.weight += weight;
    }
    /// The next keyframe came `length` further on, in the unit the measurements were made in.
    fn close(&mut self, length: f64) {
        self.log_length = (self.weight > 0.0 && length > 1e-9).then(|| length.ln() - self.sum / self.weight);
    }
    /// Logarithm of the length and its standard deviation.
    fn length(&self) -> Option<(f64, f64)> {
        Some((self.log_length?, self.weight.sqrt().recip()))
    }
}

/// Sizes of the local map.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WindowOptions {
    /// Keyframes optimised together.
    pub free_keyframes: usize,
    /// Older keyframes that stay fixed and hold position, orientation and scale.
    pub fixed_keyframes: usize,
    /// Least angle between two sightings of a new point \[rad\]. 0.5°: depth is then known to about 10 % at 0.5 px.
    pub least_parallax_rad: f64,
    /// A sighting further off than this is dropped after the adjustment \[px\].
    pub outlier_px: f64,
    /// True lets the road hold the unit of length softly, inside the adjustment.
    pub road_scale: bool,
    /// True lets points of the own lane lie on the road plane softly, inside the adjustment.
    pub road_plane: bool,
    /// Bundle adjustment.
    pub bundle: BundleOptions,
}

impl Default for WindowOptions {
    fn default() -> Self {
        Self {
            free_keyframes: 10,
            fixed_keyframes: 3,
            least_parallax_rad: 0.5_f64.to_radians(),
            outlier_px: 3.0,
            road_scale: true,
            road_plane: true,
            bundle: BundleOptions::default(),
        }
    }
}

/// `camera_from_world` and what it saw \[px\].
type View = (Pose<Camera, World>, Point2<f64>);
/// Origin and unit direction in the world.
type Ray = (Point3<f64>, Vector3<f64>);

fn ray((camera_from_world, pixel): &View, camera: &PinholeCamera) -> Ray {
    let world_from_camera = camera_from_world.inverse();
    let direction = world_from_camera.transform_vector(&camera.ray(pixel)).normalize();
    (Point3::from(world_from_camera.translation()), direction)
}

/// Keyframes and landmarks of the current segment.
#[derive(Clone, Debug)]
pub struct Window {
    options: WindowOptions,
    keyframes: VecDeque<Keyframe>,
    /// Every landmark that a keyframe of the window has seen.
    pub landmarks: Vec<Landmark>,
}

impl Window {
    /// An empty map.
    pub fn new(options: WindowOptions) -> Self {
        Self { options, keyframes: VecDeque::new(), landmarks: Vec::new() }
    }
    /// Keyframes, oldest first.
    pub fn keyframes(&self) -> impl Iterator<Item = &Keyframe> {
        self.keyframes.iter()
    }
    /// The newest keyframe.
    pub fn newest(&self) -> Option<&Keyframe> {
        self.keyframes.back()
    }
    /// Adds a keyframe and what is tracked in it; returns the keyframe that leaves, now final.
    pub fn push(&mut self, keyframe: Keyframe) -> Option<Keyframe> {
        for landmark in &mut self.landmarks {
            if let Some(pixel) = landmark.pixel {
                landmark.sightings.push((keyframe.number, pixel));
            }
        }
        if let Some(before) = self.keyframes.back_mut() {
            let step = keyframe.camera_from_world * before.camera_from_world.inverse();
            before.road.close(step.translation().norm());
        }
        self.keyframes.push_back(keyframe);
        let full = self.options.free_keyframes + self.options.fixed_keyframes;
        let left = if self.keyframes.len() > full { self.keyframes.pop_front() } else { None };
        self.forget_old_landmarks();
        left
    }
    fn forget_old_landmarks(&mut self) {
        let oldest = self.keyframes.front().map_or(0, |k| k.number);
        for landmark in &mut self.landmarks {
            landmark.sightings.retain(|(number, _)| *number >= oldest);
        }
        self.landmarks
            .retain(|l| l.pixel.is_some() || (l.point_in_world.is_some() && l.sightings.len() >= 2));
    }

    fn index_of(&self, number: usize) -> Option<usize> {
        let oldest = self.keyframes.front()?.number;
        number.checked_sub(oldest).filter(|i| *i < self.keyframes.len())
    }

    /// Gives positions to landmarks whose sightings now see them from different directions.
    pub fn triangulate(&mut self, camera: &PinholeCamera) {
        let mut landmarks = std::mem::take(&mut self.landmarks);
        // What lies on a vehicle is positioned anew each time: the adjustment does not carry it.
        let wanting = |l: &&mut Landmark| l.point_in_world.is_none() || !l.is_static();
        for landmark in landmarks.iter_mut().filter(wanting).filter(|l| l.sightings.len() >= 2) {
            landmark.point_in_world = self.position(&landmark.sightings, camera);
        }
        self.landmarks = landmarks;
    }

    /// Gives positions to landmarks seen from keyframes and, now, from a frame at `camera_from_world`: they help to locate
    /// the next frame long before the next keyframe.
    pub fn triangulate_tracked(&mut self, camera: &PinholeCamera, camera_from_world: &Pose<Camera, World>) {
        let mut landmarks = std::mem::take(&mut self.landmarks);
        for landmark in landmarks.iter_mut().filter(|l| l.point_in_world.is_none()) {
            let (Some(pixel), Some((number, first))) = (landmark.pixel, landmark.sightings.first()) else {
                continue;
            };
            let Some(keyframe) = self.index_of(*number).and_then(|i| self.keyframes.get(i)) else { continue };
            let views = [(keyframe.camera_from_world, *first), (*camera_from_world, pixel)];
            landmark.point_in_world = self.position_from(&views, &views.map(|v| ray(&v, camera)), camera);
        }
        self.landmarks = landmarks;
    }

    fn position(&self, sightings: &[(usize, Point2<f64>)], camera: &PinholeCamera) -> Option<Point3<f64>> {
        let view =
            |(n, p): &(usize, Point2<f64>)| Some((self.keyframes[self.index_of(*n)?].camera_from_world, *p));
        let views: Vec<View> = sightings.iter().filter_map(view).collect();
        let rays: Vec<_> = views.iter().map(|v| ray(v, camera)).collect();
        self.position_from(&views, &rays, camera)
    }

    /// Where the rays of the views meet.
    fn position_from(&self, views: &[View], rays: &[Ray], camera: &PinholeCamera) -> Option<Point3<f64>> {
        let (first, last) = (rays.first()?, rays.last()?);
        if first.1.angle(&last.1) < self.options.least_parallax_rad {
            return None;
        }
        let point = triangulate_rays(rays)?;
        let agrees = |(camera_from_world, pixel): &View| {
            let projected = camera.project(&camera_from_world.transform_point(&point));
            projected.is_some_and(|p| (p - pixel).norm() < self.options.outlier_px)
        };
        views.iter().all(agrees).then_some(point)
    }

    /// Bundle adjustment of the window; sightings that stay far off are dropped.
    pub fn adjust(&mut self, camera: &PinholeCamera) {
        if self.keyframes.len() < 3 {
            return;
        }
        let chosen: Vec<usize> = (0..self.landmarks.len())
            .filter(|i| {
                let l = &self.landmarks[*i];
                l.is_static() && l.point_in_world.is_some() && l.sightings.len() >= 2
            })
            .collect();
        let free_from = self.keyframes.len().saturating_sub(self.options.free_keyframes).max(2);
        let sightings = |i: &usize| -> Vec<Sighting> {
            let seen = self.landmarks[*i].sightings.iter();
            seen.filter_map(|(n, pixel)| Some(Sighting { pose: self.index_of(*n)?, pixel: *pixel })).collect()
        };
        let mut problem = BundleProblem {
            poses: self.keyframes.iter().map(|k| k.camera_from_world).collect(),
            fixed: (0..self.keyframes.len()).map(|k| k < free_from).collect(),
            points: chosen.iter().filter_map(|i| self.landmarks[*i].point_in_world).collect(),
            sightings: chosen.iter().map(sightings).collect(),
            on_road: self.all_on_road(&chosen),
            lengths: self.lengths(),
        };
        problem.solve(camera, &self.options.bundle);
        for (keyframe, pose) in self.keyframes.iter_mut().zip(&problem.poses) {
            keyframe.camera_from_world = *pose;
        }
        for (i, point) in chosen.into_iter().zip(problem.points) {
            self.keep_what_agrees(i, point, camera);
        }
        self.landmarks.retain(|l| l.pixel.is_some() || l.point_in_world.is_some());
    }

    /// Which of the landmarks lie on the road.
    fn all_on_road(&self, chosen: &[usize]) -> Vec<Option<OnRoad>> {
        let mut all: Vec<Option<OnRoad>> = chosen.iter().map(|i| self.on_road(&self.landmarks[*i])).collect();
        let mut counts = vec![0; self.keyframes.len()];
        all.iter().flatten().for_each(|o| counts[o.pose] += 1);
        all.iter_mut().flatten().for_each(|o| *o = o.shared_by(counts[o.pose]));
        all
    }

    /// Whether a landmark lies on the road as the last keyframe that saw it, and the road, has it.
    fn on_road(&self, landmark: &Landmark) -> Option<OnRoad> {
        if !self.options.road_plane || landmark.on_vehicle.is_some() {
            return None;
        }
        let seen = landmark.sightings.iter().rev().filter_map(|(n, _)| self.index_of(*n));
        let (pose, keyframe, m) =
            seen.map(|i| (i, &self.keyframes[i])).find_map(|(i, k)| Some((i, k, k.plane?)))?;
        OnRoad::of(pose, &m, &keyframe.camera_from_world.transform_point(&landmark.point_in_world?))
    }

    /// The road's say on the ways between neighbouring keyframes.
    fn lengths(&self) -> Vec<Length> {
        let told = |(k, keyframe): (usize, &Keyframe)| {
            let (log_length, sigma) = keyframe.road.length()?;
            (k + 1 < self.keyframes.len()).then_some(Length { from: k, to: k + 1, log_length, sigma })
        };
        self.keyframes.iter().enumerate().filter_map(told).collect()
    }

    /// The newest keyframe, for what the road says on the way from it.
    pub fn newest_mut(&mut self) -> Option<&mut Keyframe> {
        self.keyframes.back_mut()
    }

    fn keep_what_agrees(&mut self, index: usize, point: Point3<f64>, camera: &PinholeCamera) {
        let Self { keyframes, landmarks, options } = self;
        let oldest = keyframes.front().map_or(0, |k| k.number);
        let landmark = &mut landmarks[index];
        let before = landmark.sightings.len();
        landmark.sightings.retain(|(number, pixel)| {
            let keyframe = number.checked_sub(oldest).and_then(|i| keyframes.get(i));
            let projected =
                keyframe.and_then(|k| camera.project(&k.camera_from_world.transform_point(&point)));
            projected.is_some_and(|p| (p - pixel).norm() < options.outlier_px)
        });
        landmark.point_in_world = Some(point);
        // Half of its sightings contradict each other: it is not a static point.
        if landmark.sightings.len() < 2 || 2 * landmark.sightings.len() < before {
            landmark.point_in_world = None;
            landmark.pixel = None;
        }
    }
}
