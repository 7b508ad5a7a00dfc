//! The real drives of `MOTORCADE_SHARED` (default `../shared` beside the repository), when they are there.

use motorcade_dataset::{Format, Sequence, SequenceOptions};
use motorcade_testing::shared;

#[test]
fn the_development_drives_open() {
    let Some(kitti) = shared("kitti") else { return };
    let training = kitti.join("tracking/training");
    let mut options =
        SequenceOptions { sequence: Some("0005".into()), camera: Some(3), ..SequenceOptions::default() };
    let drive = Sequence::open(&training, &options).unwrap();
    assert_eq!((drive.len(), drive.size(), drive.summary().gaps.len()), (297, (1242, 375), 0));
    assert!((drive.camera_from_cam0().translation().x + 0.4729).abs() < 1e-3);
    assert!(drive.frames().take(3).all(|frame| frame.is_ok()));

    options.sequence = Some("0003".into());
    options.camera = None;
    options.ignore = Some(training.join("mask_02/0003"));
    options.frames = "16..=100".parse().unwrap();
    let drive = Sequence::open(&training, &options).unwrap();
    assert_eq!(drive.len(), 85);
    let first = drive.frames().next().unwrap().unwrap();
    assert_eq!((first.index, first.number, first.ignore.is_some()), (0, 16, true));

    let odometry = Sequence::open(&kitti.join("odometry/00"), &SequenceOptions::default()).unwrap();
    assert_eq!((odometry.format(), odometry.len()), (Format::KittiOdometry, 200));
}
