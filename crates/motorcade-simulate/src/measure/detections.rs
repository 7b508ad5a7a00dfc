//! Simulated vehicle detections.

use motorcade_dataset::Label;
use motorcade_perception::{BoundingBox, VehicleClass};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drive::Drive;
use crate::hash;
use crate::render::VehicleView;

/// Detections of a frame as KITTI result lines, with track −1: detectors give no identities.
pub(crate) fn of_frame(drive: &Drive, frame: usize, views: &[VehicleView]) -> Vec<Label> {
    // One random stream per frame, so that frames can be simulated in any order.
    let mut rng = ChaCha8Rng::seed_from_u64(hash::mix(drive.traffic_seed ^ 0xde7ec7) ^ frame as u64);
    let (camera, options) = (drive.camera(), &drive.detector);
    let mut found = Vec::new();
    for (vehicle, view) in drive.vehicles.iter().zip(views) {
        let Some(seen) = view.visible_px else { continue };
        let mut edge = |at: f64| at + options.edge_sigma_px * f64::from(hash::normal(rng.random()));
        let mut bbox = BoundingBox::new(seen.map(&mut edge)).clipped(camera.width, camera.height);
        if options.jump_chance > 0.0 && rng.random_bool(options.jump_chance.clamp(0.0, 1.0)) {
            let mut jump = |size: f64| size * options.jump_share * rng.random_range(-1.0..1.0);
            let [x1, y1, x2, y2] = bbox.to_array();
            let (w, h) = (x2 - x1, y2 - y1);
            let jumped = [x1 + jump(w), y1 + jump(h), x2 + jump(w), y2 + jump(h)];
            bbox = BoundingBox::new(jumped).clipped(camera.width, camera.height);
        }
        let share = view.visible_share();
        // High for near, unoccluded vehicles, lower for occluded and far ones.
        let clearness = (share / 0.6).min(1.0) * (bbox.height() / 30.0).min(1.0);
        let (uniform, wobble): (f64, f64) = (rng.random(), rng.random_range(-0.04..0.04));
        let missed = uniform < options.miss_chance + 0.5 * (1.0 - clearness).powi(2);
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
    found.extend(on_walls(drive, frame));
    found
}

/// False boxes on car-like structures beside the road: windows, bins, hedges.
fn on_walls(drive: &Drive, frame: usize) -> Vec<Label> {
    const PITCH_M: f64 = 9.0;
    let camera = drive.camera();
    let share = drive.detector.wall_boxes;
    let Some(pose) = drive.site_from_camera.get(frame).filter(|_| share > 0.0) else { return Vec::new() };
    let camera_from_site = pose.inverse();
    let (here, _) = drive.road.locate(&nalgebra::Point3::from(pose.translation()).xy());
    let mut found = Vec::new();
    for cell in (here / PITCH_M) as i64 + 1..(here / PITCH_M) as i64 + 6 {
        for side in [-1_i64, 1] {
            let uniform = |k: i64| f64::from(hash::unit(drive.seed ^ 0x3a11, 2 * cell + side.max(0), k));
            // About ten candidate positions are in sight.
            if uniform(0) > 0.1 * share {
                continue;
            }
            let d = side as f64 * (drive.road.half_width_m + 3.2 + 2.0 * uniform(1));
            let foot = drive.road.point(cell as f64 * PITCH_M + 6.0 * uniform(2), d)
                + nalgebra::Vector3::z() * (0.2 + 1.2 * uniform(3));
            let (width_m, height_m) = (1.8 + 2.2 * uniform(4), 1.3 + 0.7 * uniform(5));
            let seen = camera_from_site.transform_point(&foot);
            let Some(p) = camera.project(&seen).filter(|_| seen.z > 4.0) else { continue };
            let (w, h) = (camera.fx * width_m / seen.z, camera.fy * height_m / seen.z);
            let wobble = |k: i64| {
                f64::from(hash::normal(hash::mix(drive.traffic_seed ^ frame as u64) ^ (cell * 8 + k) as u64))
            };
            let edges =
                [p.x - 0.5 * w + wobble(0), p.y - h + wobble(1), p.x + 0.5 * w + wobble(2), p.y + wobble(3)];
            let bbox = BoundingBox::new(edges).clipped(camera.width, camera.height);
            if bbox.width() > 6.0 && bbox.height() > 14.0 {
                found.push(line(frame, VehicleClass::Car, bbox, 0.35 + 0.3 * uniform(6)));
            }
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
        bbox,
        size_hwl_m: [-1.0; 3],
        location_m: [-1000.0; 3],
        ry_rad: -10.0,
        score: Some(score),
    }
}
