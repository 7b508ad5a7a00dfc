//! Directories of results, maps of places, and lists of pictures: readers of several files, of which one is damaged.

use std::path::Path;

use image::GrayImage;
use motorcade::dataset::{Fnv, Sequence, SequenceOptions};
use motorcade::geometry::{PinholeCamera, Pose};
use motorcade::{KeptMap, PlaceMap, RecordedRun};
use motorcade_places::{Descriptor, Feature, Landmark, PlacedKeyframe};
use motorcade_testing::fuzz::{beside, texts};
use nalgebra::{Matrix6, Vector6};

use crate::fuzz;

const FRAMES: &str = "frame,status,speed_mps,scale_sigma_rel,road_pitch_rad,road_roll_rad\n5,tracked,0,0.02,0,0\n7,bridged,8,0.02,0.1,-0.02\n";
const EGO: &str = "0.5 0 0 0 0 0 0 1\n0.7 0 0 1.6 0 0 0 1\n";
const SPEEDS: &str = "frame,time_s,speed_mps,sigma_speed_mps\n5,0.5,7.9,0.2\n7,0.7,8.1,\n";
const TRACKS: &str = "frame,id,class,x_m,y_m,z_m,qx,qy,qz,qw,length_m,width_m,height_m,speed_mps,sigma_forward_m,sigma_left_m,sigma_up_m,source,p_moving,score\n\
    7,3,Car,1,1.5,20,-0.5,0.5,-0.5,0.5,4,1.8,1.5,9,0.4,0.2,0.1,predicted,0.9,0\n";

/// `ego_covariance.csv` of the frames 5 and 7.
fn covariances() -> String {
    let head: String = (0..21).map(|k| format!(",c{k}")).collect();
    let row = |n: u32| format!("\n{n}{}", ",0.5".repeat(21));
    format!("frame{head}{}{}\n", row(5), row(7))
}

#[test]
fn recorded_runs() {
    let covariances = covariances();
    let files = [
        ("frames.csv", FRAMES),
        ("ego.tum", EGO),
        ("speeds.csv", SPEEDS),
        ("tracks.csv", TRACKS),
        ("ego_covariance.csv", &covariances),
    ];
    let whole = texts(&files);
    fuzz("recorded runs", &whole, |path| {
        beside(path, &whole);
        RecordedRun::read(path.parent().unwrap()).is_ok()
    });
}

fn map() -> PlaceMap {
    let camera = PinholeCamera { fx: 40.0, fy: 40.0, cx: 24.0, cy: 16.0, width: 48, height: 32 };
    let feature =
        |i: u64| Feature { descriptor: Descriptor([i, !i, 7, 0]), pixel: [3.5, 20.0], level: 1, turn: 9 };
    let landmark = |feature| Landmark { feature, point_in_camera: [1.0, -1.0, 9.0], depth_sigma: 0.05 };
    let keyframe = |k: usize| PlacedKeyframe {
        frame: 10 * k,
        segment: 0,
        world_from_camera: Pose::exp(&Vector6::new(0.1, 0.2, 0.0, k as f64, 0.0, 3.0)),
        covariance: Matrix6::identity() * 0.01,
        way_m: 3.0 * k as f64,
        features: (0..3).map(feature).collect(),
        landmarks: (0..3).map(landmark).collect(),
        hidden: Default::default(),
    };
    PlaceMap { camera, height_m: 1.65, keyframes: (0..3).map(keyframe).collect() }
}

/// A map's file, and what stands in it, which its checksum keeps damage from.
#[test]
fn maps() {
    let sample = map().to_bytes();
    fuzz("maps", &[("a.map", &sample)], |path| KeptMap::read(path).is_ok());
    let again = |path: &Path| {
        let bytes = std::fs::read(path).unwrap();
        let content = &bytes[..bytes.len().saturating_sub(8)];
        let sum = u64::from_str_radix(&Fnv::of(content).to_string(), 16).unwrap();
        std::fs::write(path, [content, &sum.to_le_bytes()].concat()).unwrap();
        let Ok(kept) = KeptMap::read(path) else { return false };
        assert!(kept.map.summary().way_m.is_finite());
        assert!(kept.map.keyframes.iter().all(|k| k.world_from_camera.is_finite()));
        // As `map info` and `map merge` use it.
        kept.map.to_ply();
        PlaceMap::from_bytes(&kept.map.to_bytes()).unwrap();
        true
    };
    fuzz("contents of maps", &[("a.map", &sample)], again);
}

const RGB: &str =
    "# time picture\n1305031102.175304 rgb/a.png\n1305031102.211214 rgb/b.png\n1305031102.25 a/c.png\n";
const SECONDS: &str = "0.000000e+00\n1.036224e-01\n2.072449e-01\n";
const DATES: &str = "2011-09-26 23:59:59.902345678\n2011-09-27 00:00:00.005\n2011-09-27 00:00:00.108\n";

/// A drive of small pictures: these names, all the same picture.
fn drive(root: &Path, pictures: &[&str]) -> bool {
    for name in pictures {
        let path = root.join(name);
        if !path.exists() {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            GrayImage::new(24, 16).save(path).unwrap();
        }
    }
    let options = SequenceOptions { prefetch: 0, ..SequenceOptions::default() };
    let Ok(drive) = Sequence::open(root, &options) else { return false };
    assert_eq!(drive.timestamps_ns().len(), drive.len());
    true
}

#[test]
fn lists_of_pictures_and_times() {
    fuzz("lists of pictures", &texts(&[("t/rgb.txt", RGB)]), |path| {
        drive(path.parent().unwrap(), &["rgb/a.png", "rgb/b.png", "a/c.png"])
    });
    let odometry = |path: &Path| {
        drive(path.parent().unwrap(), &["image_0/000000.png", "image_0/000001.png", "image_0/000002.png"])
    };
    fuzz("times of pictures", &texts(&[("o/times.txt", SECONDS)]), odometry);
    let raw = |path: &Path| {
        let root = path.parent().and_then(Path::parent).unwrap();
        let names = [0, 1, 2].map(|n| format!("image_02/data/{n:010}.png"));
        drive(root, &names.each_ref().map(String::as_str))
    };
    fuzz("dates of pictures", &texts(&[("r/image_02/timestamps.txt", DATES)]), raw);
}
