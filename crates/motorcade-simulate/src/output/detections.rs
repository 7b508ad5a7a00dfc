//! What a good detector would have found in a picture.

use motorcade_dataset::Label;
use motorcade_perception::{BoundingBox, VehicleClass};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drive::Drive;
use crate::hash;
use crate::render::Picture;

/// How the detector errs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectorOptions {
    /// Standard deviation of a box edge \[px\].
    pub edge_sigma_px: f64,
    /// Chance to miss a vehicle that is plainly visible; those hidden or small are missed more often.
    pub miss_chance: f64,
    /// Expected number of boxes on nothing in a frame.
    pub false_boxes: f64,
    /// Vehicles lower than this are not found \[px\].
    pub least_height_px: f64,
}

impl Default for DetectorOptions {
    fn default() -> Self {
        Self { edge_sigma_px: 1.2, miss_chance: 0.02, false_boxes: 0.03, least_height_px: 14.0 }
    }
}

/// Detections of a frame as result lines; track −1, as a detector knows no identities.
pub(crate) fn of_frame(
    drive: &Drive,
    frame: usize,
    picture: &Picture,
    options: &DetectorOptions,
) -> Vec<Label> {
    // A stream of its own for every frame: frames can be made in any order.
    let mut rng = ChaCha8Rng::seed_from_u64(hash::mix(drive.seed ^ 0xde7ec7) ^ frame as u64);
    let camera = drive.camera();
    let mut found = Vec::new();
    for (vehicle, view) in drive.vehicles.iter().zip(&picture.views) {
        let Some(seen) = view.visible_px else { continue };
        let mut edge = |at: f64| at + options.edge_sigma_px * f64::from(hash::normal(rng.random()));
        let bbox = BoundingBox::new(seen.map(&mut edge)).clipped(camera.width, camera.height);
        let share = view.visible_share();
        // Certain in the open and near; less so behind others and far away.
        let clearness = (share / 0.6).min(1.0) * (bbox.height() / 30.0).min(1.0);
        let (lot, wobble): (f64, f64) = (rng.random(), rng.random_range(-0.04..0.04));
        let missed = lot < options.miss_chance + 0.5 * (1.0 - clearness).powi(2);
        let small = bbox.height() < options.least_height_px || bbox.width() < 4.0 || share < 0.2;
        if !missed && !small {
            found.push(line(frame, vehicle.class, bbox, (0.55 + 0.4 * clearness + wobble).clamp(0.05, 0.99)));
        }
    }
    if rng.random_bool(options.false_boxes.clamp(0.0, 1.0)) {
        let height = rng.random_range(18.0..60.0);
        let (width, x) =
            (height * rng.random_range(0.8..1.8), rng.random_range(0.0..0.9) * f64::from(camera.width));
        let y = camera.cy + rng.random_range(-30.0..30.0);
        let bbox = BoundingBox::new([x, y, x + width, y + height]).clipped(camera.width, camera.height);
        if bbox.area() > 50.0 {
            found.push(line(frame, VehicleClass::Car, bbox, rng.random_range(0.2..0.6)));
        }
    }
    found
}

fn line(frame: usize, class: VehicleClass, bbox: BoundingBox, score: f64) -> Label {
    Label {
        frame: frame as u64,
        track: -1,
        class: class.name().to_owned(),
        truncated: -1.0,
        occluded: -1.0,
        alpha_rad: -10.0,
        bbox_px: bbox.to_array(),
        size_hwl_m: [-1.0; 3],
        location_m: [-1000.0; 3],
        ry_rad: -10.0,
        score: Some(score),
    }
}
