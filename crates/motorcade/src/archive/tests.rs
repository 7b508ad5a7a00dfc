//! Tests of archives: every record comes back with its bits.

use std::fmt::Debug;

use motorcade_geometry::Pose;
use motorcade_odometry::{FrameRecord, FrameStatus, RoadCurvature, RoadMeasurement, RoadState};
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass, VehicleKeypoints};
use motorcade_places::{Descriptor, Feature, HiddenParts, PlaceKeyframe};
use motorcade_shape::{HeadingEvidence, Layout, ObservedKeypoint};
use nalgebra::{Matrix3, Matrix6, Point2, Vector2, Vector3, Vector6};

use super::*;

/// A number that no shorter notation has.
fn number(k: usize, i: usize) -> f64 {
    ((k * 131 + i * 17) as f64).sin()
}

pub(crate) fn motion(k: usize) -> FrameRecord {
    FrameRecord {
        timestamp_ns: k as i64 * -33_333_333,
        status: [
            FrameStatus::Initialising,
            FrameStatus::Tracked,
            FrameStatus::Standstill,
            FrameStatus::Bridged,
        ][k % 4],
        segment: if k.is_multiple_of(7) { usize::MAX } else { k },
        keyframe: k + 1,
        camera_from_keyframe: Pose::exp(&Vector6::from_fn(|i, _| number(k, i))),
        inliers: k + 2,
        rms_px: number(k, 6),
        covariance: Matrix6::from_fn(|i, j| number(k, 7 + 6 * i + j)),
    }
}

fn measurement(k: usize) -> RoadMeasurement {
    let curvature = RoadCurvature {
        value: number(k, 20),
        variance: number(k, 21),
        cross_covariance: Vector3::from_fn(|i, _| number(k, 22 + i)),
        prior_sigma: number(k, 25),
    };
    RoadMeasurement {
        frame: k,
        reference: k / 2,
        state: RoadState {
            log_inverse_height: number(k, 0),
            pitch_rad: number(k, 1),
            roll_rad: -number(k, 2),
        },
        baseline: number(k, 3),
        covariance: Matrix3::from_fn(|i, j| number(k, 4 + 3 * i + j)),
        curvature: k.is_multiple_of(2).then_some(curvature),
        agreement: number(k, 14),
        pixels: 3 * k,
    }
}

fn place(k: usize) -> PlaceKeyframe {
    let feature = |i: usize| Feature {
        descriptor: Descriptor([i as u64, u64::MAX, (k * i) as u64, 1 << 63]),
        pixel: [number(k, i) as f32, i as f32 + 0.1],
        level: (i % 4) as u8,
        turn: (7 * i % 256) as u8,
    };
    let hidden = HiddenParts::of((64, k as u32), |x, y| x > y);
    PlaceKeyframe { frame: k, segment: k / 3, features: (0..k % 50).map(feature).collect(), hidden }
}

fn detections(k: usize) -> Vec<Detection> {
    let one = |i: usize| Detection {
        class: VehicleClass::ALL[i % 5],
        score: number(k, i),
        bbox: BoundingBox::new([1, 2, 3, 4].map(|j| number(k, i + j))),
        convention: [BoxConvention::VisibleExtent, BoxConvention::ProjectedCuboid][i % 2],
        external_id: i.is_multiple_of(3).then_some(-(i as i64)),
        pixel_size: number(k, i + 5),
        road_below: i.is_multiple_of(2).then_some(number(k, i + 6)),
    };
    (0..k % 7).map(one).collect()
}

fn keypoints(k: usize) -> Vec<VehicleKeypoints> {
    let point = |i: usize| ObservedKeypoint {
        pixel: Point2::new(number(k, i), number(k, i + 1)),
        confidence: number(k, i + 2),
        sigma_px: i.is_multiple_of(2).then_some(Vector2::new(number(k, i + 3), number(k, i + 4))),
    };
    let one = |i: usize| VehicleKeypoints {
        layout: [Layout::Car36, Layout::Car14][i % 2],
        points: (0..i * 9).map(point).collect(),
        bbox: BoundingBox::new([1, 2, 3, 4].map(|j| number(k, i + j))),
        heading: HeadingEvidence::new((0..4 * i).map(|j| number(k, j).abs()).collect()),
        presence: i.is_multiple_of(2).then_some(number(k, i + 6)),
    };
    (0..k % 4).map(one).collect()
}

/// Debug output of floats is the shortest that reads back as the same bits.
fn comes_back<T: Stored + Debug>(record: impl Fn(usize) -> T) {
    for mut archive in [Archive::default(), Archive::unwritable()] {
        for start in [0, 100, 150, 400] {
            let end = [100, 150, 400, 401].into_iter().find(|end| *end > start).unwrap();
            archive.put_away((start..end).map(&record).collect());
            archive.put_away(Vec::new());
            assert_eq!(archive.len(), end);
        }
        assert_eq!(archive.kept.is_empty(), archive.file.is_some());
        let back = archive.take_back().unwrap();
        assert_eq!((back.len(), archive.len()), (401, 0));
        for (k, found) in back.iter().enumerate() {
            assert_eq!(format!("{found:?}"), format!("{:?}", record(k)), "record {k}");
        }
    }
}

#[test]
fn every_record_comes_back_with_its_bits() {
    comes_back(motion);
    comes_back(measurement);
    comes_back(place);
    comes_back(detections);
    comes_back(keypoints);
    comes_back(|k| f64::from_bits(k as u64 ^ 0x8000_0000_0000_0000));
}

#[test]
fn a_named_file_goes_on_from_a_state_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made/motion");
    let named = || Archive::<FrameRecord>::named(path.clone());
    let mut archive = named();
    let none = archive.state().unwrap();
    assert!(none.len() == 0 && !path.exists());
    archive.put_away((0..40).map(motion).collect());
    let state = archive.state().unwrap();
    archive.put_away((40..90).map(motion).collect());
    drop(archive);
    let mut resumed = named().resumed(&state).unwrap();
    resumed.put_away((40..50).map(motion).collect());
    let later = resumed.state().unwrap();
    let back = resumed.take_back().unwrap();
    let text = |records: &[_]| format!("{records:?}");
    assert_eq!(text(&back), text(&(0..50).map(motion).collect::<Vec<_>>()));
    assert!(named().resumed(&later).is_ok() && Archive::<f64>::default().resumed(&later).is_err());
    let mut bytes = fs::read(&path).unwrap();
    bytes[7] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert!(named().resumed(&later).is_err());
    // Without a record in it the file of an earlier run is replaced.
    let mut empty = named().resumed(&none).unwrap();
    empty.put_away(vec![motion(3)]);
    assert_eq!(text(&empty.take_back().unwrap()), text(&[motion(3)]));
    assert!(Archive::<f64>::unwritable().state().is_err());
}

#[test]
fn a_named_file_keeps_its_name_when_its_records_are_taken_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut archive = Archive::<FrameRecord>::named(folder.path().join("motion"));
    assert!(archive.take_back().unwrap().is_empty());
    for count in [3, 2] {
        archive.put_away((0..count).map(motion).collect());
        let state = archive.state().unwrap();
        let named = Archive::<FrameRecord>::named(folder.path().join("motion"));
        assert_eq!(named.resumed(&state).unwrap().take_back().unwrap().len(), count);
        assert_eq!(archive.take_back().unwrap().len(), count);
    }
}

#[test]
fn a_file_that_cannot_be_written_any_more_leaves_the_later_records_in_memory() {
    let mut archive = Archive::default();
    archive.put_away((0..300).map(motion).collect());
    // A file that reads and does not write.
    let path = tempfile::NamedTempFile::new().unwrap();
    let written = archive.file.take().unwrap();
    io::copy(&mut { rewound(written) }, &mut path.as_file()).unwrap();
    archive.file = Some(File::open(path.path()).unwrap());
    archive.put_away((300..500).map(motion).collect());
    archive.put_away((500..600).map(motion).collect());
    assert_eq!((archive.count, archive.kept.len()), (300, 300));
    let back = archive.take_back().unwrap();
    let same = |(k, found): (usize, &FrameRecord)| format!("{found:?}") == format!("{:?}", motion(k));
    assert!(back.len() == 600 && back.iter().enumerate().all(same));
}

fn rewound(mut file: File) -> File {
    file.seek(SeekFrom::Start(0)).unwrap();
    file
}

#[test]
fn a_file_that_does_not_read_back_is_an_error() {
    let mut archive = Archive::default();
    archive.put_away((0..3).map(motion).collect());
    archive.break_file();
    assert!(archive.take_back().is_err());
    assert!(archive.len() == 0 && archive.take_back().unwrap().is_empty());
}
