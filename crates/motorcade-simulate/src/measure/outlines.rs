//! Visible vehicles of a frame and their occlusions, by their outlines alone.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use motorcade_perception::BoundingBox;
use nalgebra::Point2;

use crate::drive::Drive;
use crate::render::{VehicleView, projected, vehicle_mesh};

/// A vehicle in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisibleVehicle {
    /// Index in the drive.
    pub vehicle: usize,
    pub pose: Pose<Camera, Vehicle>,
    /// Box of the whole vehicle, not clipped \[px\].
    pub whole: BoundingBox,
    /// Depth along the optical axis \[m\].
    pub depth_m: f64,
}

/// The vehicles of a frame that are in the image and wholly in front of the camera, in the drive's order.
#[derive(Clone, Debug)]
pub(crate) struct FrameOutlines {
    pub camera: PinholeCamera,
    pub vehicles: Vec<VisibleVehicle>,
}

/// Part of a box that occludes, as a share of its half size: vehicles do not fill their boxes.
const SOLID: f64 = 0.85;

impl FrameOutlines {
    pub(crate) fn of(drive: &Drive, frame: usize) -> Self {
        let camera = drive.camera();
        let one = |vehicle: usize| {
            let pose = drive.camera_from_vehicle(vehicle, frame)?;
            let depth_m = pose.translation().z;
            if !(0.5..400.0).contains(&depth_m) {
                return None;
            }
            let whole =
                BoundingBox::new(projected(&camera, &vehicle_mesh(drive.vehicles.get(vehicle)?), &pose)?);
            let inside = whole.clipped(camera.width, camera.height);
            (inside.width() > 1.0 && inside.height() > 1.0).then_some(VisibleVehicle {
                vehicle,
                pose,
                whole,
                depth_m,
            })
        };
        Self { camera, vehicles: (0..drive.vehicles.len()).filter_map(one).collect() }
    }

    /// True when another vehicle than `owner` (index in the drive) occludes a point.
    pub(crate) fn occludes(&self, pixel: &Point2<f64>, depth_m: f64, owner: Option<usize>) -> bool {
        self.vehicles.iter().any(|s| {
            let [x1, y1, x2, y2] = s.whole.to_array();
            let inside = |p: f64, a: f64, b: f64| (p - 0.5 * (a + b)).abs() < 0.5 * SOLID * (b - a);
            Some(s.vehicle) != owner
                && s.depth_m < depth_m - 0.5
                && inside(pixel.x, x1, x2)
                && inside(pixel.y, y1, y2)
        })
    }

    /// Views as of a rendered image; boxes of partly occluded vehicles are those of the whole vehicle.
    pub(crate) fn views(&self, vehicles: usize) -> Vec<VehicleView> {
        const GRID: usize = 12;
        let mut views = vec![VehicleView::default(); vehicles];
        for s in &self.vehicles {
            let inside = s.whole.clipped(self.camera.width, self.camera.height);
            let [x1, y1, x2, y2] = inside.to_array();
            let place = |i: usize, a: f64, b: f64| a + (b - a) * (i as f64 + 0.5) / GRID as f64;
            let free = (0..GRID * GRID)
                .filter(|k| {
                    let p = Point2::new(place(k % GRID, x1, x2), place(k / GRID, y1, y2));
                    !self.occludes(&p, s.depth_m, Some(s.vehicle))
                })
                .count();
            // Quarter pixels, as the renderer counts.
            let own = 4.0 * inside.area();
            let visible = own * free as f64 / (GRID * GRID) as f64;
            views[s.vehicle] = VehicleView {
                visible_samples: visible as u64,
                own_samples: own as u64,
                visible_px: (visible >= 1.0).then(|| inside.to_array()),
            };
        }
        views
    }
}
