//! Readers on damaged files: an answer or an error, in time, never a panic. Every input follows from a seed, so that a failure comes again.
//!
//! Variables of the environment set the time of each reader (`motorcade_testing::fuzz`), and `found.rs` holds what was found once:
//! `MOTORCADE_FUZZ_SECONDS=60 cargo test --release -p motorcade -p motorcade-fleet --test fuzz -- --nocapture`. The readers of tables, manifests and
//! evaluations stand in motorcade-fleet, which knows those crates.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

mod found;
mod runs;
mod samples;

use std::cell::RefCell;
use std::io::Write;
use std::path::{Path, PathBuf};

use motorcade::dataset::Frame;
use motorcade::dataset::{
    Calibration, GpsTrack, Sequence, SequenceOptions, SpeedRecord, read_labels, read_trajectory,
    read_vehicle_poses,
};
use motorcade::geometry::{Camera, PinholeCamera, World};
use motorcade::perception::{
    Checkpoint, DetectionTable, KeypointTable, Manifest, ModelOptions, ModelSet, Perception, Recording,
};
use motorcade::{Config, Motorcade, RunRecord, StateFolder, StateWriter};
use motorcade_graph::g2o;
use motorcade_shape::ShapePrior;
use motorcade_testing::fuzz::{folder, texts};
use motorcade_testing::onnx;

/// Gives `reader` damaged versions of the samples, as files of these names, and every input that failed once.
fn fuzz(name: &str, samples: &[(&str, &[u8])], reader: impl Fn(&Path) -> bool) {
    motorcade_testing::fuzz::fuzz(name, samples, &found::of(name), reader);
}

#[test]
fn calibrations() {
    let all = [
        ("camera.toml", samples::CAMERA_TOML),
        ("opencv.yaml", samples::OPENCV_YAML),
        ("camchain.yaml", samples::KALIBR_YAML),
        ("orb.yaml", samples::ORB_YAML),
        ("0005.txt", samples::KITTI_CALIB),
    ];
    fuzz("calibrations", &texts(&all), |path| Calibration::read(path, None).is_ok());
}

#[test]
fn boxes_and_labels() {
    fuzz("labels", &texts(&[("0005.txt", samples::LABELS)]), |path| read_labels(path).is_ok());
    let all = [("labels.txt", samples::LABELS), ("det.txt", samples::MOT), ("boxes.csv", samples::BOXES_CSV)];
    fuzz("detections", &texts(&all), |path| DetectionTable::read(path).is_ok());
    fuzz("keypoints", &texts(&[("k.csv", samples::KEYPOINTS)]), |path| KeypointTable::read(path).is_ok());
    let poses = |path: &Path| read_vehicle_poses(&[path.to_path_buf()] as &[PathBuf]).is_ok();
    fuzz("vehicle poses", &texts(&[("v.csv", samples::VEHICLE_POSES)]), poses);
    fuzz("perception", &texts(&[("p.jsonl", samples::PERCEPTION)]), |path| Recording::read(path).is_ok());
}

#[test]
fn trajectories_and_sensors() {
    let all = [("ego.tum", samples::TUM), ("poses.txt", samples::KITTI_POSES)];
    fuzz("trajectories", &texts(&all), |path| read_trajectory::<World, Camera>(path).is_ok());
    fuzz("speeds", &texts(&[("speeds.csv", samples::SPEEDS)]), |path| SpeedRecord::read(path).is_ok());
    let all = [("a.gpx", samples::GPX), ("a.nmea", samples::NMEA), ("a.csv", samples::GPS_CSV)];
    fuzz("gps tracks", &texts(&all), |path| GpsTrack::read(path).is_ok());
}

#[test]
fn graphs_and_shapes() {
    let read = |path: &Path| g2o::read(path, &g2o::ReadOptions::default()).is_ok();
    fuzz("g2o", &texts(&[("a.g2o", samples::G2O)]), read);
    let mut prior = ShapePrior::of_family(motorcade_shape::Layout::Car14).to_json();
    prior.push('\n');
    fuzz("shape priors", &texts(&[("prior.json", &prior)]), |path| ShapePrior::read(path).is_ok());
}

#[test]
fn settings_and_records() {
    let config = samples::config();
    let overlay = |path: &Path| {
        let Ok(text) = std::fs::read_to_string(path) else { return false };
        Config::default().overlay(&text, "c.toml").is_ok()
    };
    // Comments are most of the text and never an error, and the whole of it takes a millisecond: most inputs are a table of it, without them.
    let bare = samples::without_comments(&config);
    let whole = [("c.toml", config.as_str()), ("d.toml", &bare)];
    let tables = samples::tables(&bare);
    let tables = tables.iter().map(|table| ("e.toml", table.as_str()));
    fuzz("configuration", &texts(&whole.into_iter().chain(tables).collect::<Vec<_>>()), overlay);
    let parent = |path: &Path| path.parent().map(PathBuf::from).unwrap();
    fuzz("models.toml", &texts(&[("m/models.toml", samples::MODELS)]), |path| {
        Manifest::of_folder(&parent(path)).is_ok()
    });
    fuzz("run records", &texts(&[("r/run.json", samples::RECORD)]), |path| {
        RunRecord::read(&parent(path)).is_ok()
    });
}

/// ONNX files behind our loader: read, checked and prepared, not run. One has a constant that the engine computes while it prepares.
#[test]
fn networks() {
    let (network, computed) = (onnx::network(&[&[1, 3, 32, 32]]), onnx::hungry(&[1, 3, 32, 32]));
    let all = [("n/tiny.onnx", network.as_slice()), ("n/tiny.onnx", computed.as_slice())];
    fuzz("networks", &all, |path| {
        let folder = path.parent().unwrap();
        std::fs::write(folder.join("models.toml"), samples::TINY_MODEL).unwrap();
        ModelSet::load(folder, (64, 48), &ModelOptions::default()).is_ok()
    });
}

#[test]
fn checkpoints() {
    let frame = |number| Frame { number, ..Frame::from_gray(image::GrayImage::new(24, 16), 0) };
    let run = || vec![("version".to_owned(), "1".to_owned())];
    let observe = |checkpoint| {
        let mut perception = Perception::none();
        perception.save_in(checkpoint);
        (0..3).all(|number| perception.observe(&frame(number)).is_ok())
    };
    let folder = folder();
    let path = folder.path().join("checkpoint");
    assert!(observe(Checkpoint::create(&path, run()).unwrap()));
    let sample = std::fs::read(&path).unwrap();
    fuzz("checkpoints", &[("checkpoint", sample.as_slice())], |path| {
        Checkpoint::resume(path, run()).is_ok_and(|found| found.is_some_and(observe))
    });
}

/// The file of a state, and what stands in it, which the file's checksum keeps damage from.
#[test]
fn states() {
    let camera = PinholeCamera { fx: 40.0, fy: 40.0, cx: 24.0, cy: 16.0, width: 48, height: 32 };
    let slam = || Motorcade::builder(camera).height_m(1.5).build().unwrap();
    let mut driven = slam();
    for k in 0..3 {
        let image = image::GrayImage::from_fn(48, 32, |x, y| image::Luma([((x + k) * 37 + y * 11) as u8]));
        driven.push(&Frame::from_gray(image, i64::from(k) * 100_000_000)).unwrap();
    }
    let state = driven.state().unwrap();
    // One that refused a state has not changed, and takes the next.
    let waiting = RefCell::new(slam());
    let resume = |path: &Path| {
        let is_accepted = waiting.borrow_mut().resume(&std::fs::read(path).unwrap()).is_ok();
        if is_accepted {
            waiting.replace(slam());
        }
        is_accepted
    };
    fuzz("states", &[("state", state.as_slice())], resume);
    let mut driven = slam();
    for k in 0..6 {
        let image = image::GrayImage::from_fn(48, 32, |x, y| image::Luma([((x + k) * 37 + y * 11) as u8]));
        driven.step(&Frame::from_gray(image, i64::from(k) * 100_000_000)).unwrap();
    }
    let estimated = driven.state().unwrap();
    fuzz("states of estimates", &[("state", estimated.as_slice())], resume);
    let folder = folder();
    let of = |path: &Path| StateFolder::new(path.to_path_buf(), "run".to_owned());
    let fill = |to: &mut StateWriter| {
        to.write_all(&state)?;
        to.end_part();
        Ok::<(), std::io::Error>(())
    };
    of(&folder.path().join("s")).write(fill).unwrap();
    let file = std::fs::read(folder.path().join("s/state")).unwrap();
    fuzz("state files", &[("s/state", file.as_slice())], |path| {
        of(path.parent().unwrap()).read().is_ok_and(|parts| parts.is_some())
    });
}

#[test]
fn pictures() {
    let encoded = samples::pictures();
    let names = ["a/000000.png", "b/000000.jpg", "c/000000.webp", "d/000000.bmp", "e/000000.tif"];
    let all: Vec<(&str, &[u8])> = names.into_iter().zip(encoded.iter().map(Vec::as_slice)).collect();
    fuzz("pictures", &all, |path| {
        let options = SequenceOptions { prefetch: 0, ..SequenceOptions::default() };
        let opened = Sequence::open(path.parent().unwrap(), &options);
        opened.is_ok_and(|drive| drive.frames().all(|frame| frame.is_ok()))
    });
}
