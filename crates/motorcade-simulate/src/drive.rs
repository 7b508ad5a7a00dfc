//! A drive with exact ground truth.

use std::sync::Arc;

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle, World};

use crate::motion::Road;
use crate::options::DetectorOptions;
use crate::options::RenderOptions;
use crate::plan::Staging;
use crate::site::Site;
use crate::vehicle::SimulatedVehicle;

/// Poses of the camera and of all vehicles at every frame.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Name of its scenario.
    pub name: String,
    /// Seed of the streets: houses, trees, textures, repairs.
    pub seed: u64,
    /// Seed of all that is another one at the next visit: traffic, parked cars, suspension, noise of sensor and detector.
    pub traffic_seed: u64,
    /// The visit whose traffic has the seed of the streets, where this is another one: the houses stand where they left room for that one.
    pub first_visit: Option<Arc<Drive>>,
    /// Camera, frame rate, weather and sensor.
    pub render: RenderOptions,
    /// Errors of the simulated detector.
    pub detector: DetectorOptions,
    /// The road.
    pub road: Road,
    /// `site_from_camera` at each frame.
    pub site_from_camera: Vec<Pose<Site, Camera>>,
    /// All vehicles but the camera's own.
    pub vehicles: Vec<SimulatedVehicle>,
    /// Houses that look alike, and darkness.
    pub staging: Staging,
}

impl Drive {
    /// Number of frames.
    pub fn len(&self) -> usize {
        self.site_from_camera.len()
    }
    /// True without frames.
    pub fn is_empty(&self) -> bool {
        self.site_from_camera.is_empty()
    }
    /// The camera.
    pub fn camera(&self) -> PinholeCamera {
        self.render.camera
    }
    /// Way from the first frame to each \[m\].
    pub(crate) fn ways_m(&self) -> Vec<f64> {
        let place = |k: usize| self.site_from_camera[k].translation();
        let mut way_m = 0.0;
        (0..self.len())
            .map(|k| {
                way_m += k.checked_sub(1).map_or(0.0, |before| (place(k) - place(before)).norm());
                way_m
            })
            .collect()
    }
    /// True where no light reaches the camera.
    pub fn is_dark(&self, frame: usize) -> bool {
        let time_s = frame as f64 / self.render.fps;
        self.staging.dark_s.iter().any(|(from, to)| (*from..*to).contains(&time_s))
    }
    /// `world_from_camera` at each frame; the world is the first camera.
    pub fn world_from_camera(&self) -> Vec<Pose<World, Camera>> {
        self.site_from_camera.first().map_or_else(Vec::new, |first| self.as_seen_from(first))
    }
    /// As [`world_from_camera`](Self::world_from_camera), in the world of the first visit; `None` where this is it.
    pub fn first_visit_from_camera(&self) -> Option<Vec<Pose<World, Camera>>> {
        let first = self.first_visit.as_ref()?.site_from_camera.first()?;
        Some(self.as_seen_from(first))
    }
    /// The poses in the world whose origin is a camera.
    fn as_seen_from(&self, first: &Pose<Site, Camera>) -> Vec<Pose<World, Camera>> {
        let world_from_site: Pose<World, Site> = first.inverse().cast();
        self.site_from_camera.iter().map(|pose| world_from_site * *pose).collect()
    }
    /// Pose of a vehicle in the camera of a frame; `None` when either is not there.
    pub fn camera_from_vehicle(&self, vehicle: usize, frame: usize) -> Option<Pose<Camera, Vehicle>> {
        let site_from_vehicle = (*self.vehicles.get(vehicle)?.poses.get(frame)?)?;
        Some(self.site_from_camera.get(frame)?.inverse() * site_from_vehicle)
    }
    /// Length of the camera's path \[m\].
    pub fn length_m(&self) -> f64 {
        let steps = self.site_from_camera.windows(2);
        steps.map(|pair| (pair[1].translation() - pair[0].translation()).norm()).sum()
    }
}
