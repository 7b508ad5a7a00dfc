//! Rendering of a drive's frames.

use std::sync::Arc;

use image::{GrayImage, ImageBuffer};
use motorcade_geometry::{Camera, PinholeCamera, Pose};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::air::Air;
use super::colour::Colour;
use super::conditions::{self, Exposed};
use super::lighting::Lighting;
use super::look::VehicleLook;
use super::mirror::MirrorPlane;
use super::picture::{Picture, VehicleView};
use super::raster::{Band, Drawn, NOTHING, facing, project};
use super::repairs::Repairs;
use super::resolve::{Resolved, Surface, VisiblePart, resolve};
use super::scene::{Scene, Varied};
use super::shadow::{ShadowCaster, Shadows};
use super::textures::Textures;
use super::{sensor, tunnel, varied_mesh, vehicle_mesh};
use crate::drive::Drive;
use crate::form::Form;
use crate::hash;
use crate::mesh::{Building, Chunk, Material, Mesh};
use crate::options::{Look, RenderOptions};
use crate::scenery;
use crate::site::Site;
use crate::weather::Weather;

/// Image rows per task.
const BAND_ROWS: usize = 8;
/// Rows that a rolling shutter reads at once: half a millisecond of 30 at 480 rows.
const STRIP_ROWS: u32 = 4;
/// Largest distance of drawn scenery \[m\]: haze hides it beyond.
const FAR_M: f64 = 900.0;

/// Renderer with the static scenery of a drive; frames can be rendered in any order and from several threads.
#[derive(Debug)]
pub struct Renderer<'a> {
    drive: &'a Drive,
    chunks: Vec<Chunk>,
    buildings: Vec<Building>,
    vehicles: Vec<Mesh>,
    forms: Vec<Form>,
    textures: Arc<Textures>,
    repairs: Repairs,
    /// One per vehicle with varied appearance.
    looks: Vec<VehicleLook>,
    /// Way from the first frame to each \[m\].
    ways_m: Vec<f64>,
}

impl<'a> Renderer<'a> {
    /// Builds scenery, textures and meshes.
    pub fn new(drive: &'a Drive) -> Self {
        Self::with_textures(drive, Arc::new(Textures::new(hash::mix(drive.seed ^ 0x7e87))), Vec::new())
    }

    /// With given textures and further static scenery.
    pub(crate) fn with_textures(drive: &'a Drive, textures: Arc<Textures>, more: Vec<Chunk>) -> Self {
        let (mut chunks, buildings) = scenery::build(drive);
        chunks.extend(more);
        let looks: Vec<VehicleLook> = match drive.render.look {
            Look::Plain => Vec::new(),
            Look::Varied => {
                drive.vehicles.iter().map(|v| VehicleLook::of(drive.traffic_seed, v.id, v.class)).collect()
            }
        };
        let mesh = |(i, vehicle): (usize, &crate::vehicle::SimulatedVehicle)| match looks.get(i) {
            Some(look) => varied_mesh::mesh(vehicle, look),
            None => vehicle_mesh::mesh(vehicle),
        };
        Self {
            drive,
            chunks,
            buildings,
            vehicles: drive.vehicles.iter().enumerate().map(mesh).collect(),
            forms: drive.vehicles.iter().map(crate::vehicle::SimulatedVehicle::form).collect(),
            textures,
            repairs: Repairs::of(&drive.road, drive.seed),
            looks,
            ways_m: drive.ways_m(),
        }
    }

    pub(super) fn drive(&self) -> &Drive {
        self.drive
    }

    /// Mesh of a vehicle in its own frame \[m\].
    pub(crate) fn vehicle_mesh(&self, vehicle: usize) -> Option<&Mesh> {
        self.vehicles.get(vehicle)
    }

    /// Renders one frame; `None` when the drive has no such frame.
    pub fn render(&self, frame: usize) -> Option<Picture> {
        let pose = *self.drive.site_from_camera.get(frame)?;
        let options = &self.drive.render;
        let now = FrameTime { frame, later: 0.0 };
        let (mut light, mut picture) = self.expose_in(&self.scene(now), now, &options.camera, &pose);
        let samples = options.sensor.blur_samples;
        if samples > 1 {
            // The frame's own time is the middle of the shutter's: blur shifts nothing. An even number has no exposure
            // there; a further one then gives depth and instances alone.
            if samples.is_multiple_of(2) {
                light.par_iter_mut().for_each(|c| *c = [0.0; 3]);
            }
            for k in (0..samples).filter(|k| 2 * k + 1 != samples) {
                let share = (k as f64 + 0.5) / samples as f64 - 0.5;
                let then = FrameTime { frame, later: share * options.sensor.shutter_s * options.fps };
                let moved =
                    pose_at_time(then, |i| self.drive.site_from_camera.get(i).copied()).unwrap_or(pose);
                let more = self.expose_in(&self.scene(then), then, &options.camera, &moved).0;
                light.par_iter_mut().zip(more).for_each(|(a, b)| {
                    *a = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
                });
            }
            let share = 1.0 / samples as f32;
            light.par_iter_mut().for_each(|c| *c = [c[0] * share, c[1] * share, c[2] * share]);
        }
        if options.sensor.readout_s > 0.0 {
            light = self.expose_rows(frame, &pose);
        }
        if self.drive.is_dark(frame) {
            light.par_iter_mut().for_each(|c| *c = [0.0; 3]);
        }
        let exposure =
            if options.weather == Weather::Tunnel { tunnel::gain(self.drive, frame) as f32 } else { 1.0 };
        picture.rgb = sensor::expose(&light, options, exposure, self.drive.traffic_seed, frame);
        Some(picture)
    }

    /// Strips of rows as a rolling shutter sees them, each at its own time.
    fn expose_rows(&self, frame: usize, pose: &Pose<Site, Camera>) -> Vec<Colour> {
        let RenderOptions { camera, fps, sensor, .. } = self.drive.render;
        let strip = |row: u32| {
            let height = STRIP_ROWS.min(camera.height - row);
            let middle = f64::from(row) + 0.5 * f64::from(height - 1);
            let share = (middle - 0.5 * f64::from(camera.height - 1)) / f64::from(camera.height);
            let then = FrameTime { frame, later: share * sensor.readout_s * fps };
            let moved = pose_at_time(then, |i| self.drive.site_from_camera.get(i).copied()).unwrap_or(*pose);
            let part = PinholeCamera { cy: camera.cy - f64::from(row), height, ..camera };
            self.expose_in(&self.scene(then), then, &part, &moved).0
        };
        (0..camera.height).step_by(STRIP_ROWS as usize).flat_map(strip).collect()
    }

    pub(super) fn scene(&self, time: FrameTime) -> Scene<'_> {
        let caster = |v: &crate::vehicle::SimulatedVehicle| {
            let pose = pose_at_time(time, |i| v.poses.get(i).copied().flatten())?;
            let forward = pose.transform_vector(&Vector3::x());
            Some(ShadowCaster {
                centre: [pose.translation().x, pose.translation().y],
                forward: [forward.x, forward.y],
                half_length_m: 0.47 * v.size.length_m,
                half_width_m: 0.47 * v.size.width_m,
                height_m: v.size.height_m,
            })
        };
        let air = Air::of(&self.drive.render);
        let varied = (self.drive.render.look == Look::Varied).then(|| Varied {
            lighting: Lighting::of(self.drive.seed, &air),
            looks: &self.looks,
            axes: self
                .drive
                .vehicles
                .iter()
                .map(|v| {
                    let pose = pose_at_time(time, |i| v.poses.get(i).copied().flatten()).unwrap_or_default();
                    [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| pose.transform_vector(&axis))
                })
                .collect(),
        });
        Scene {
            drive: self.drive,
            buildings: &self.buildings,
            textures: &self.textures,
            repairs: &self.repairs,
            forms: &self.forms,
            air,
            shadows: Shadows::new(&self.drive.vehicles.iter().filter_map(caster).collect::<Vec<_>>()),
            sun: varied.as_ref().map_or_else(|| self.drive.render.sun(), |v| v.lighting.sun),
            varied,
        }
    }

    /// Everything but the sensor, in the conditions of the weather.
    fn expose_in(
        &self,
        scene: &Scene<'_>,
        time: FrameTime,
        camera: &PinholeCamera,
        pose: &Pose<Site, Camera>,
    ) -> (Vec<Colour>, Picture) {
        let (mut light, picture) = self.expose_once(scene, time, camera, pose);
        if self.drive.render.weather == Weather::WetMirror {
            if let Some(plane) = MirrorPlane::of(camera, pose, &picture.depth_m, &picture.road) {
                let (below, mirrored) = plane.mirrored(camera, pose);
                let mirror = self.expose_of(scene, time, (&below, &mirrored), Ground::Omitted).0;
                plane.reflect(&mut light, &mirror, &picture.road, camera, pose);
            }
            return (light, picture);
        }
        let (depth_m, road) = (&picture.depth_m, picture.road.as_raw());
        let exposed = Exposed { light: &mut light, depth_m, road };
        let way_m = self.ways_m.get(time.frame).copied().unwrap_or(0.0);
        conditions::apply(exposed, self.drive, camera, pose, way_m);
        (light, picture)
    }

    /// Everything but the sensor and the conditions of the weather.
    pub(super) fn expose_once(
        &self,
        scene: &Scene<'_>,
        time: FrameTime,
        camera: &PinholeCamera,
        pose: &Pose<Site, Camera>,
    ) -> (Vec<Colour>, Picture) {
        self.expose_of(scene, time, (camera, pose), Ground::Drawn)
    }

    fn expose_of(
        &self,
        scene: &Scene<'_>,
        time: FrameTime,
        (camera, pose): (&PinholeCamera, &Pose<Site, Camera>),
        ground: Ground,
    ) -> (Vec<Colour>, Picture) {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let (surfaces, drawn, mut views) = self.draw(camera, time, pose, ground);
        let resolved: Vec<Resolved> = by_band(&drawn, height)
            .into_par_iter()
            .enumerate()
            .map(|(i, here)| {
                let row = i * BAND_ROWS;
                let mut band = Band::new(0..width, row, BAND_ROWS.min(height - row));
                for index in here {
                    band.draw(index, &drawn[index as usize]);
                }
                resolve(scene, camera, pose, &surfaces, &drawn, &band)
            })
            .collect();

        let mut light = Vec::with_capacity(width * height);
        let mut picture = Picture {
            rgb: image::RgbImage::default(),
            depth_m: Vec::with_capacity(width * height),
            instance: ImageBuffer::default(),
            road: GrayImage::default(),
            views: Vec::new(),
        };
        let (mut instance, mut road) = (Vec::new(), Vec::new());
        let mut seen = vec![VisiblePart::NONE; self.vehicles.len()];
        for part in resolved {
            light.extend(part.light);
            picture.depth_m.extend(part.depth_m);
            instance.extend(part.instance);
            road.extend(part.road);
            for (vehicle, more) in part.seen {
                seen[vehicle].merge(&more);
            }
        }
        for (view, seen) in views.iter_mut().zip(&seen) {
            view.visible_samples = seen.samples;
            // A sample represents a quarter of a pixel.
            view.visible_px = (seen.samples > 0)
                .then(|| [seen.low[0] - 0.25, seen.low[1] - 0.25, seen.high[0] + 0.25, seen.high[1] + 0.25]);
        }
        picture.views = views;
        picture.instance = ImageBuffer::from_raw(camera.width, camera.height, instance).unwrap_or_default();
        picture.road = GrayImage::from_raw(camera.width, camera.height, road).unwrap_or_default();
        (light, picture)
    }

    /// Projects the triangles that may be in view.
    pub(super) fn draw(
        &self,
        camera: &PinholeCamera,
        time: FrameTime,
        pose: &Pose<Site, Camera>,
        ground: Ground,
    ) -> (Vec<Surface>, Vec<Drawn>, Vec<VehicleView>) {
        let (mut surfaces, mut drawn) = (Vec::new(), Vec::new());
        let camera_from_site = pose.inverse();
        let eye = Point3::from(pose.translation());
        for chunk in &self.chunks {
            if !in_sight(camera, &camera_from_site.transform_point(&chunk.centre), chunk.radius_m) {
                continue;
            }
            let shown = |m: Material| ground == Ground::Drawn || m != Material::Ground;
            for triangle in chunk.mesh.triangles.iter().filter(|t| shown(t.material)) {
                let normal = facing(&triangle.normal, &(eye - triangle.corners[0].position));
                let to_camera = |v: &crate::mesh::Vertex| camera_from_site.transform_point(&v.position);
                project(camera, triangle, to_camera, surfaces.len() as u32, &mut drawn);
                surfaces.push(Surface { material: triangle.material, normal, owner: 0 });
            }
        }
        let mut views = vec![VehicleView::default(); self.vehicles.len()];
        for (i, (mesh, vehicle)) in self.vehicles.iter().zip(&self.drive.vehicles).enumerate() {
            let pose_at = |i: usize| vehicle.poses.get(i).copied().flatten();
            let Some(site_from_vehicle) = pose_at_time(time, pose_at) else { continue };
            let camera_from_vehicle = camera_from_site * site_from_vehicle;
            let reach = 0.5 * vehicle.size.to_vector().norm() + 0.5 * vehicle.size.height_m;
            if !in_sight(camera, &Point3::from(camera_from_vehicle.translation()), reach) {
                continue;
            }
            let first = drawn.len();
            for triangle in &mesh.triangles {
                let to_camera = |v: &crate::mesh::Vertex| camera_from_vehicle.transform_point(&v.position);
                let normal = site_from_vehicle.transform_vector(&triangle.normal);
                let at = site_from_vehicle.transform_point(&triangle.corners[0].position);
                project(camera, triangle, to_camera, surfaces.len() as u32, &mut drawn);
                surfaces.push(Surface {
                    material: triangle.material,
                    normal: facing(&normal, &(eye - at)),
                    owner: i as u16 + 1,
                });
            }
            views[i].own_samples = own_samples(&drawn[first..]);
        }
        (surfaces, drawn, views)
    }
}

/// The ground in a picture: left out of one that is taken from below it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Ground {
    Drawn,
    Omitted,
}

/// A time: that of a frame, and an offset in frames (less than one, either sign).
#[derive(Clone, Copy)]
pub(super) struct FrameTime {
    pub(super) frame: usize,
    pub(super) later: f64,
}

/// Pose at a time, interpolated between frames or extrapolated just beyond them; `None` where its frame has none.
fn pose_at_time<From>(
    time: FrameTime,
    pose_at: impl Fn(usize) -> Option<Pose<Site, From>>,
) -> Option<Pose<Site, From>> {
    let FrameTime { frame, later } = time;
    let here = pose_at(frame)?;
    let (next, previous) = (pose_at(frame + 1), frame.checked_sub(1).and_then(&pose_at));
    Some(match (next, previous) {
        // Linear extrapolation, also backwards.
        (Some(next), _) => here.interpolate(&next, later),
        (None, Some(previous)) => here.interpolate(&previous, -later),
        (None, None) => here,
    })
}

/// Indices of the triangles that overlap each band, in their order.
fn by_band(drawn: &[Drawn], height: usize) -> Vec<Vec<u32>> {
    let mut bands = vec![Vec::new(); height.div_ceil(BAND_ROWS)];
    for (i, triangle) in drawn.iter().enumerate() {
        let (first, end) = triangle.rows;
        let first = (first.max(0) as usize / BAND_ROWS).min(bands.len());
        let end = (end.max(0) as usize).div_ceil(BAND_ROWS).clamp(first, bands.len());
        for band in &mut bands[first..end] {
            band.push(i as u32);
        }
    }
    bands
}

/// Box of all mesh corners; `None` when one is behind the camera.
pub(crate) fn projected(
    camera: &PinholeCamera,
    mesh: &Mesh,
    camera_from_vehicle: &Pose<Camera, motorcade_geometry::Vehicle>,
) -> Option<[f64; 4]> {
    let mut b = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    for corner in mesh.triangles.iter().flat_map(|t| &t.corners) {
        let seen = camera_from_vehicle.transform_point(&corner.position);
        let p = if seen.z > 0.3 { camera.project(&seen)? } else { return None };
        b = [b[0].min(p.x), b[1].min(p.y), b[2].max(p.x), b[3].max(p.y)];
    }
    Some(b)
}

/// Quarter pixels that a vehicle covers without occlusion.
fn own_samples(drawn: &[Drawn]) -> u64 {
    let extent = |of: &dyn Fn(&Drawn) -> (i32, i32)| {
        drawn.iter().map(of).fold((i32::MAX, 0), |all, one| (all.0.min(one.0), all.1.max(one.1)))
    };
    let (rows, columns) = (extent(&|d| d.rows), extent(&|d| d.columns));
    if rows.0 >= rows.1 || columns.0 >= columns.1 {
        return 0;
    }
    let columns = columns.0 as usize..columns.1 as usize;
    let mut band = Band::new(columns, rows.0 as usize, (rows.1 - rows.0) as usize);
    drawn.iter().for_each(|d| band.draw(0, d));
    band.drawn.iter().filter(|d| **d != NOTHING).count() as u64
}

/// False when a sphere is certainly outside the view.
fn in_sight(camera: &PinholeCamera, centre: &Point3<f64>, radius_m: f64) -> bool {
    if centre.z < -radius_m || centre.z > FAR_M {
        return false;
    }
    // Planes through the image's edges.
    let outside = |edge: f64, focal: f64, across: f64| {
        let slope = edge / focal;
        (across - slope * centre.z) / (1.0 + slope * slope).sqrt()
    };
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    outside(w - camera.cx, camera.fx, centre.x) < radius_m
        && -outside(-1.0 - camera.cx, camera.fx, centre.x) < radius_m
        && outside(h - camera.cy, camera.fy, centre.y) < radius_m
        && -outside(-1.0 - camera.cy, camera.fy, centre.y) < radius_m
}
