//! Crops are reproducible and their labels exact.

use super::*;
use crate::training::crop::Visibility;
use motorcade_shape::Layout;

const OPTIONS: VehicleCropOptions = VehicleCropOptions { count: 12, seed: 3, side_px: 48, margin: 1.5 };

fn column(crop: &Crop, name: &str) -> f64 {
    let place = COLUMNS.iter().position(|c| *c == name).unwrap();
    f64::from(crop.numbers[place])
}

fn street_crops(number: u64) -> Vec<Crop> {
    crops_of_street(&OPTIONS, number, &Arc::new(Textures::new(1)))
}

#[test]
fn files_are_the_same_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let written = |threads: usize| {
        let out = folder.path().join(threads.to_string());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| write_vehicle_crops(&OPTIONS, &out, &|_| ())).unwrap();
        ["crops.npy", "keypoints.npy", "sights.npy", "numbers.npy", "crops.json"]
            .map(|name| fs::read(out.join(name)).unwrap())
    };
    let (one, three) = (written(1), written(3));
    assert!(one == three);
    // Header of 128 bytes, then 12 crops of 48 × 48 pixels of three bytes.
    assert_eq!(one[0].len(), 128 + 12 * 48 * 48 * 3);
    assert!(one[0].starts_with(b"\x93NUMPY\x01\x00"));
    assert_eq!((one[0].len() - 128) % 64, 0);
}

#[test]
fn keypoints_are_the_projections_of_the_drawing() {
    let street = Street::draw(OPTIONS.seed, 1);
    let mut compared = 0;
    for crop in street_crops(1) {
        let view = &street.views[column(&crop, "view") as usize];
        let frame = column(&crop, "view") as usize;
        let vehicle = &street.drive.vehicles[view.target];
        let pose = street.drive.camera_from_vehicle(view.target, frame).unwrap();
        let Some(places) = vehicle.keypoints(Layout::Car36) else {
            assert!(crop.sights.iter().all(|s| *s == Visibility::Unknown as u8));
            continue;
        };
        for (place, [x, y]) in places.iter().zip(crop.keypoints) {
            let pixel = view.camera.project(&pose.transform_point(place)).unwrap();
            // The picture's left edge is at −0.5.
            let back = |at: f32, edge: &str, scale: &str| {
                (f64::from(at) - column(&crop, edge)) * column(&crop, scale) - 0.5
            };
            let found =
                [back(x, "picture_x1_px", "px_per_crop_x"), back(y, "picture_y1_px", "px_per_crop_y")];
            assert!(
                (found[0] - pixel.x).abs() < 0.02 && (found[1] - pixel.y).abs() < 0.02,
                "{found:?} {pixel}"
            );
            compared += 1;
        }
    }
    assert!(compared > 200, "{compared}");
}

#[test]
fn keypoints_that_are_seen_lie_in_the_box_of_what_is_seen() {
    let crops: Vec<Crop> = (0..3).flat_map(street_crops).collect();
    let mut seen = 0;
    for crop in crops.iter().filter(|c| column(c, "box_is_visible_part") > 0.5) {
        let [x1, y1, x2, y2] = ["box_x1_px", "box_y1_px", "box_x2_px", "box_y2_px"].map(|n| column(crop, n));
        // A drawing's keypoints lie on an ideal body, a few centimetres off the mesh.
        let slack = 0.06 * (x2 - x1);
        for ([x, y], _) in crop.keypoints.iter().zip(crop.sights).filter(|k| k.1 == Visibility::Visible as u8)
        {
            let (x, y) = (f64::from(*x), f64::from(*y));
            let inside = x > x1 - slack && x < x2 + slack && y > y1 - slack && y < y2 + slack;
            assert!(inside, "({x}, {y}) of [{x1}, {y1}, {x2}, {y2}] in view {}", column(crop, "view"));
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn crops_are_of_all_headings_sizes_and_kinds_of_hiding() {
    let crops: Vec<Crop> = (0..6).flat_map(street_crops).collect();
    let share =
        |test: &dyn Fn(&Crop) -> bool| crops.iter().filter(|c| test(c)).count() as f64 / crops.len() as f64;
    assert!(crops.len() > 50, "{}", crops.len());
    for quarter in 0..4 {
        let low = -std::f64::consts::PI + f64::from(quarter) * std::f64::consts::FRAC_PI_2;
        let within = |c: &Crop| (low..low + std::f64::consts::FRAC_PI_2).contains(&column(c, "heading_rad"));
        assert!(share(&within) > 0.08, "{quarter}: {}", share(&within));
    }
    assert!(share(&|c| column(c, "inside_share") < 0.95) > 0.08);
    assert!(share(&|c| column(c, "seen_share") < 0.9) > 0.15);
    // No crop is black or flat.
    for crop in &crops {
        let (low, high) = crop.pixels.iter().fold((255, 0), |(a, b), p| (a.min(*p), b.max(*p)));
        assert!(high > low + 30, "{low} {high}");
    }
}

#[test]
fn options_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for bad in [
        VehicleCropOptions { count: 0, ..OPTIONS },
        VehicleCropOptions { side_px: 4, ..OPTIONS },
        VehicleCropOptions { margin: f64::NAN, ..OPTIONS },
    ] {
        assert!(write_vehicle_crops(&bad, folder.path(), &|_| ()).is_err(), "{bad:?}");
    }
}
