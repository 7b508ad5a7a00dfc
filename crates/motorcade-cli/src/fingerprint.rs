//! A hash of all that decides a run's results, to recognise a run that is already there.

use std::fs;
use std::path::Path;

use motorcade::{Config, RunRecord};
use motorcade_dataset::{Fnv, regular_file};
use motorcade_perception::{Identity, ModelOptions};

use crate::arguments::RunArguments;

/// A hash of fields, each ended by a byte that no text has.
#[derive(Default)]
struct Fields(Fnv);

impl Fields {
    fn add(&mut self, bytes: &[u8]) {
        self.0.add(bytes);
        self.0.add(&[0xff]);
    }
    /// A file by its content, a folder by its files' names and sizes.
    fn add_path(&mut self, path: &Path) {
        self.add(path.as_os_str().as_encoded_bytes());
        if let Ok(entries) = fs::read_dir(path) {
            let describe = |e: fs::DirEntry| (e.file_name(), e.metadata().map_or(0, |m| m.len()));
            let mut files: Vec<_> = entries.flatten().map(describe).collect();
            files.sort();
            for (name, size) in files {
                self.add(name.as_encoded_bytes());
                self.add(&size.to_le_bytes());
            }
        } else if let Ok(content) = regular_file::read(path) {
            self.add(&content);
        }
    }
    /// The files of a folder by their contents.
    fn add_contents(&mut self, folder: &Path) {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<_> = entries.map(|entry| entry.path()).collect();
        files.sort();
        for file in files {
            self.add_path(&file);
        }
    }
}

/// The fingerprint of a run: program, input, configuration, height, perception. Threads and progress do not matter.
pub fn fingerprint(
    arguments: &RunArguments,
    input_hash: &str,
    height_m: Option<f64>,
    config: &Config,
) -> String {
    let mut hash = Fields::default();
    hash.add(env!("CARGO_PKG_VERSION").as_bytes());
    hash.add(input_hash.as_bytes());
    hash.add(&height_m.unwrap_or(f64::NAN).to_le_bytes());
    hash.add(serde_json::to_string(config).unwrap_or_default().as_bytes());
    hash.add(format!("{:?}", arguments.trajectory_scale).as_bytes());
    // Engines differ by rounding, which is enough to make another run.
    hash.add(format!("{:?}", ModelOptions::default().engine).as_bytes());
    arguments.shape_prior.iter().for_each(|path| hash.add_path(path));
    arguments.keypoints.iter().for_each(|path| hash.add_path(path));
    arguments.vehicle_poses.iter().for_each(|path| hash.add_path(path));
    hash.add(&[u8::from(arguments.keep_perception)]);
    // Other files, as with --keep-perception; without them the fingerprint of earlier runs stays.
    arguments.save_map.iter().for_each(|path| hash.add(path.as_os_str().as_encoded_bytes()));
    if let Some(path) = &arguments.map {
        hash.add(b"map");
        hash.add_path(path);
    }
    if arguments.input.calibrates() {
        hash.add(b"calibration auto");
    }
    if arguments.parquet {
        hash.add(b"parquet");
    }
    for (name, path) in [("speed", &arguments.speed), ("gps", &arguments.gps)] {
        if let Some(path) = path {
            hash.add(name.as_bytes());
            hash.add_path(path);
            hash.add(format!("{:?}", arguments.clock_offset).as_bytes());
        }
    }
    let files = [
        &arguments.models,
        &arguments.detections,
        &arguments.road_masks,
        &arguments.perception,
        &arguments.input.ignore,
        &arguments.trajectory,
    ];
    for path in files {
        match path {
            Some(path) => hash.add_path(path),
            None => hash.add(b"-"),
        }
    }
    hash.0.to_string()
}

/// The parts of a fingerprint that a checkpoint names when one differs; the last one is the whole.
pub fn identity(arguments: &RunArguments, input_hash: &str, config: &Config, fingerprint: &str) -> Identity {
    let settings = Fnv::of(serde_json::to_string(config).unwrap_or_default().as_bytes());
    let mut networks = Fields::default();
    networks.add(format!("{:?}", ModelOptions::default().engine).as_bytes());
    match &arguments.models {
        Some(folder) => networks.add_contents(folder),
        None => networks.add(b"inside"),
    }
    let parts = [
        ("version of the program", env!("CARGO_PKG_VERSION").to_owned()),
        ("input", input_hash.to_owned()),
        ("set of settings", settings.to_string()),
        ("set of networks", networks.0.to_string()),
        ("height, or another option or file that was given,", fingerprint.to_owned()),
    ];
    parts.map(|(name, value)| (name.to_owned(), value)).into()
}

/// True when `directory` holds a stopped run with this fingerprint, whose results are those of a part of the drive.
pub fn stopped(directory: &Path, fingerprint: &str) -> bool {
    let Ok(record) = RunRecord::read(directory) else { return false };
    record.fingerprint.as_deref() == Some(fingerprint) && record.interrupted == Some(true)
}

/// True when `directory` holds a finished run with this fingerprint.
pub fn already_done(directory: &Path, fingerprint: &str) -> bool {
    let Ok(record) = RunRecord::read(directory) else { return false };
    record.fingerprint.as_deref() == Some(fingerprint) && record.interrupted == Some(false)
}
