//! Simulated measurements agree with the ground truth and with rendered images.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_simulate::{
    Drive, KeypointOptions, MeasureOptions, RenderOptions, Renderer, Scenario, WriteOptions, simulate,
};

fn drive(name: &str, frames: usize, seed: u64) -> Drive {
    let options = RenderOptions::default().with_width(414);
    simulate(&Scenario::by_name(name).unwrap(), frames, seed, &options).unwrap()
}

/// All files below a folder with their bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut out = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            out.extend(files(&entry.path()).into_iter().map(|(k, v)| (format!("{name}/{k}"), v)));
        } else {
            out.insert(name, std::fs::read(entry.path()).unwrap());
        }
    }
    out
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let written = |seed: u64, threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let drive = drive("dense", 5, seed);
        pool.install(|| {
            drive.write_geometry(folder.path(), &WriteOptions::default(), &MeasureOptions::default()).unwrap()
        });
        files(folder.path())
    };
    let (one, two, other) = (written(3, 1), written(3, 2), written(4, 1));
    assert_eq!(one, two);
    for kind in ["landmarks", "points", "road_matches", "keypoints"] {
        let name = format!("training/{kind}/0000.csv");
        assert!(one[&name].len() > 500, "{name}");
        assert_ne!(one[&name], other[&name], "{name}");
    }
    assert!(!one.keys().any(|k| k.contains("image")), "{:?}", one.keys());
}

#[test]
fn perfect_measurements_are_projections_of_the_truth() {
    let drive = drive("slope", 12, 2);
    let all = drive.measure(&MeasureOptions::perfect()).unwrap();
    let (camera, poses) = (drive.camera(), drive.world_from_camera());
    assert!(all.points.len() > 500, "{}", all.points.len());
    for o in &all.points {
        let seen = poses[o.frame].inverse().transform_point(&all.landmarks_in_world[o.point]);
        assert!((camera.project(&seen).unwrap() - o.pixel).norm() < 1e-9 && !o.outlier);
    }
    // On this stretch the road is still level: the plane under the camera carries every match of the first frames.
    let first = all.road_matches.iter().filter(|m| m.frame == 0);
    let second_from_first = poses[1].inverse() * poses[0];
    let mut compared = 0;
    for m in first {
        let up = drive.site_from_camera[0].inverse().transform_vector(&nalgebra::Vector3::z());
        let height = drive.site_from_camera[0].translation().z
            - drive.road.surface(&drive.site_from_camera[0].translation().xy().into()).0;
        let ray = camera.ray(&m.first);
        let place = nalgebra::Point3::from(ray * (-height / ray.dot(&up)));
        let again = camera.project(&second_from_first.transform_point(&place)).unwrap();
        assert!((again - m.second).norm() < 0.5, "{again} {}", m.second);
        compared += 1;
    }
    assert!(compared > 50, "{compared}");
}

#[test]
fn noise_outliers_and_drop_outs_are_as_asked_for() {
    let drive = drive("straight", 20, 2);
    let perfect = drive.measure(&MeasureOptions::perfect()).unwrap();
    let asked = MeasureOptions {
        pixel_sigma_px: 0.7,
        outlier_share: 0.1,
        drop_chance: 0.2,
        ..MeasureOptions::default()
    };
    let noisy = drive.measure(&asked).unwrap();
    let share = noisy.points.len() as f64 / perfect.points.len() as f64;
    assert!((share - 0.8).abs() < 0.04, "{share} of the points are left");
    let truth: BTreeMap<(usize, usize), _> =
        perfect.points.iter().map(|o| ((o.frame, o.point), o.pixel)).collect();
    let (mut squares, mut count, mut wrong) = (0.0, 0.0, 0.0);
    for o in &noisy.points {
        if o.outlier {
            wrong += 1.0;
        } else {
            squares += (o.pixel - truth[&(o.frame, o.point)]).norm_squared();
            count += 1.0;
        }
    }
    let sigma = f64::sqrt(squares / (2.0 * count));
    assert!((sigma - 0.7).abs() < 0.05, "{sigma} px");
    assert!((wrong / (wrong + count) - 0.1_f64).abs() < 0.03, "{wrong} wrong of {count}");
    let bad = MeasureOptions { outlier_share: f64::NAN, ..asked };
    assert!(drive.measure(&bad).unwrap_err().to_string().contains("outliers"));
}

#[test]
fn hidden_and_cut_keypoints_are_less_sure() {
    let drive = drive("dense", 41, 1);
    let picture = Renderer::new(&drive).render(40).unwrap();
    let found = drive.keypoints_of(40, &picture, &KeypointOptions::default());
    assert!(found.len() >= 2 * 50, "{}", found.len());
    let camera = drive.camera();
    let (mut sure, mut unsure) = (0, 0);
    for k in &found {
        assert!((0.0..=1.0).contains(&k.confidence) && camera.contains(&k.pixel, -0.51));
        let index = drive.vehicles.iter().position(|v| v.id == k.track_id).unwrap();
        let (x, y) = (k.pixel.x.round() as u32, k.pixel.y.round() as u32);
        let shown = picture.instance.get_pixel_checked(x, y).map_or(0, |p| usize::from(p.0[0]));
        if k.confidence > 0.5 {
            sure += 1;
            // A clearly visible keypoint lies on its vehicle, or beside it within its noise.
            let near = (-4..=4_i64).any(|dx| {
                (-4..=4_i64).any(|dy| {
                    let at = (i64::from(x) + dx, i64::from(y) + dy);
                    u32::try_from(at.0)
                        .ok()
                        .zip(u32::try_from(at.1).ok())
                        .and_then(|(x, y)| picture.instance.get_pixel_checked(x, y))
                        .is_some_and(|p| usize::from(p.0[0]) == index + 1)
                })
            });
            assert!(near, "{k:?} lies on {shown}");
        } else {
            unsure += 1;
        }
    }
    assert!(sure > 20 && unsure > 20, "{sure} sure, {unsure} unsure");
}

#[test]
fn exact_keypoints_are_those_of_a_network_without_errors() {
    let drive = drive("dense", 41, 1);
    let picture = Renderer::new(&drive).render(40).unwrap();
    let exact = drive.keypoints_of(40, &picture, &KeypointOptions::exact());
    let quiet = KeypointOptions { sigma_px: 0.0, sigma_share: 0.0, swap_chance: 0.0, ..Default::default() };
    let quiet = drive.keypoints_of(40, &picture, &quiet);
    let noisy = drive.keypoints_of(40, &picture, &KeypointOptions::default());
    assert_eq!(exact.len(), quiet.len());
    let camera = drive.camera();
    let (mut inside, mut moved) = (0, 0);
    for ((a, b), c) in exact.iter().zip(&quiet).zip(&noisy) {
        assert!([1.0, 0.2, 0.1, 0.05].contains(&a.confidence));
        if camera.contains(&a.pixel, 0.0) {
            assert!((a.pixel - b.pixel).norm() < 1e-9);
            inside += 1;
            moved += usize::from((a.pixel - c.pixel).norm() > 0.05);
        } else {
            assert!(a.confidence < 0.06, "{a:?}");
        }
    }
    assert!(inside > 100 && 10 * moved > 9 * inside, "{inside} inside, {moved} moved");
}
