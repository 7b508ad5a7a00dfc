//! A written drive reads back as simulated.

use motorcade_dataset::{Cam0, Sequence, SequenceOptions, read_labels, read_trajectory};
use motorcade_geometry::{Camera, Pose, World};
use motorcade_perception::{DetectionTable, RoadMaskFolder};
use motorcade_simulate::{ReenactOptions, RenderOptions, Scenario, WriteOptions, reenact, simulate};

const FRAMES: usize = 4;

#[test]
fn a_written_drive_reads_back() {
    let options = RenderOptions::default().with_width(414);
    let drive = simulate(&Scenario::by_name("dense").unwrap(), FRAMES, 3, &options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let write = WriteOptions { sequence: "0042".into(), depth: true, instance: true, ..Default::default() };
    let calls = std::sync::atomic::AtomicUsize::new(0);
    let count = |_: usize| {
        calls.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    };
    let written = drive.write_kitti(folder.path(), &write, &count).unwrap();
    assert_eq!(calls.into_inner(), FRAMES);

    let asked = SequenceOptions { sequence: Some("0042".into()), camera: Some(2), ..Default::default() };
    let sequence = Sequence::open(&written.training, &asked).unwrap();
    let (camera, truth) = (sequence.camera().unwrap(), drive.camera());
    assert!((camera.fx - truth.fx).abs() < 1e-6 && (camera.cy - truth.cy).abs() < 1e-6);
    assert_eq!((camera.width, camera.height), (truth.width, truth.height));
    assert!(sequence.camera_from_cam0().log().norm() < 1e-12);
    assert_eq!(sequence.frames().filter(Result::is_ok).count(), FRAMES);

    let poses = read_trajectory::<World, Cam0>(&written.training.join("gt_poses/0042.txt")).unwrap().poses;
    assert_eq!(poses.len(), FRAMES);
    for (read, made) in poses.iter().zip(drive.world_from_camera()) {
        let read: Pose<World, Camera> = read.cast();
        assert!((read.inverse() * made).log().norm() < 1e-6);
    }

    let labels = read_labels(&written.training.join("label_02/0042.txt")).unwrap();
    assert!(labels.len() == written.labels && labels.len() > 2 * FRAMES);
    for label in &labels {
        let vehicle = drive.vehicles.iter().position(|v| i64::from(v.id) == label.track).unwrap();
        let pose = drive.camera_from_vehicle(vehicle, label.frame as usize).unwrap();
        assert!((pose.translation() - nalgebra::Vector3::from(label.location_m)).norm() < 1e-3);
        let [x1, y1, x2, y2] = label.bbox.to_array();
        assert!(x1 >= 0.0 && y1 >= 0.0 && x1 < x2 && y1 < y2, "{label:?}");
        assert!(x2 <= f64::from(truth.width) - 1.0 && y2 <= f64::from(truth.height) - 1.0, "{label:?}");
    }
    let found = DetectionTable::read(&written.detections).unwrap();
    assert!(found.frames() == FRAMES && found.of_frame(0).iter().all(|d| d.external_id.is_none()));
    let masks = RoadMaskFolder::open(&written.road_masks.unwrap()).unwrap();
    let mask = masks.of_frame(0, sequence.size()).unwrap().unwrap();
    assert!(mask.is_road(0.45 * 414.0, 118.0) && !mask.is_road(207.0, 5.0));
    assert!((0.1..0.5).contains(&mask.road_fraction()));
}

#[test]
fn names_that_leave_the_folder_are_refused() {
    let drive = simulate(&Scenario::by_name("demo").unwrap(), 1, 3, &RenderOptions::default().with_width(64))
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let write = WriteOptions { sequence: "../up".into(), ..Default::default() };
    assert!(drive.write_kitti(folder.path(), &write, &|_| {}).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_reenacted_drive_has_the_way_and_the_vehicles_of_the_first() {
    let options = RenderOptions::default().with_width(414);
    let drive = simulate(&Scenario::by_name("bends").unwrap(), 60, 3, &options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut short = drive.clone();
    short.site_from_camera.truncate(3);
    let written = short.write_kitti(folder.path(), &WriteOptions::default(), &|_| {}).unwrap();
    let labels = read_labels(&written.training.join("label_02/0000.txt")).unwrap();

    let again =
        reenact("bends again", &drive.world_from_camera(), &labels, &ReenactOptions::default(), &options)
            .unwrap();
    assert_eq!(again.len(), drive.len());
    for (a, b) in drive.world_from_camera().iter().zip(again.world_from_camera()) {
        assert!((a.inverse() * b).log().norm() < 1e-9);
    }
    for (frame, camera) in again.site_from_camera.iter().enumerate() {
        let position = camera.translation();
        let (z, _) = again.road.surface(&position.xy().into());
        assert!((position.z - z - 1.65).abs() < 0.25, "frame {frame}: {} m above the road", position.z - z);
        let (_, d) = again.road.locate(&position.xy().into());
        assert!((d + 1.75).abs() < 0.4, "frame {frame}: {d} m beside the middle");
    }
    let label = &labels[0];
    let vehicle = again.vehicles.iter().position(|v| i64::from(v.id) == label.track).unwrap();
    let pose = again.camera_from_vehicle(vehicle, 0).unwrap();
    let off = pose.translation() - nalgebra::Vector3::from(label.location_m);
    assert!(off.x.abs() < 0.1 && off.z.abs() < 0.1 && off.y.abs() < 0.6, "{off}");
}
