//! File layouts of the KITTI benchmarks.

use std::path::{Path, PathBuf};

use super::layout::{Choice, Contents, Layout};
use crate::error::{Error, Result};
use crate::text::TextFile;

/// A split of KITTI tracking.
pub(crate) struct Tracking;
/// A sequence of KITTI odometry.
pub(crate) struct Odometry;
/// A drive of KITTI raw.
pub(crate) struct Raw;

impl Layout for Tracking {
    fn name(&self) -> &'static str {
        "kitti-tracking"
    }

    fn recognises(&self, folder: &Path) -> Result<bool> {
        Ok(["image_02", "image_03"].iter().any(|name| folder.join(name).is_dir()))
    }

    fn contents(&self, root: &Path, choice: Choice<'_>) -> Result<Contents> {
        tracking(root, choice.sequence, choice.camera.unwrap_or(2))
    }

    fn is_kitti(&self) -> bool {
        true
    }
}

impl Layout for Odometry {
    fn name(&self) -> &'static str {
        "kitti-odometry"
    }

    fn recognises(&self, folder: &Path) -> Result<bool> {
        Ok((0..4).any(|camera| folder.join(format!("image_{camera}")).is_dir()))
    }

    fn contents(&self, root: &Path, choice: Choice<'_>) -> Result<Contents> {
        let camera = choice.camera.map_or_else(|| first_camera(root, "image_", 1), Ok)?;
        let images = existing(root, format!("image_{camera}"))?;
        of_camera(camera, &images, &root.join("calib.txt"), &root.join("times.txt"))
    }

    fn is_kitti(&self) -> bool {
        true
    }
}

impl Layout for Raw {
    fn name(&self) -> &'static str {
        "kitti-raw"
    }

    fn recognises(&self, folder: &Path) -> Result<bool> {
        Ok((0..4).any(|camera| folder.join(format!("image_{camera:02}/data")).is_dir()))
    }

    fn contents(&self, root: &Path, choice: Choice<'_>) -> Result<Contents> {
        let camera = choice.camera.map_or_else(|| first_camera(root, "image_", 2), Ok)?;
        let folder = existing(root, format!("image_{camera:02}"))?;
        // The calibration of a day stands beside its drives.
        let beside = root.parent().map(|day| day.join("calib_cam_to_cam.txt"));
        let calibration =
            beside.filter(|path| path.is_file()).unwrap_or_else(|| root.join("calib_cam_to_cam.txt"));
        of_camera(camera, &folder.join("data"), &calibration, &folder.join("timestamps.txt"))
    }

    fn is_kitti(&self) -> bool {
        true
    }
}

/// Contents of one camera; calibration and times where they exist.
fn of_camera(camera: u8, images: &Path, calibration: &Path, times: &Path) -> Result<Contents> {
    let times_ns = times.is_file().then(|| read_times(times)).transpose()?;
    let mut contents = Contents::of_folder(images)?;
    contents.calibration = Some(calibration.to_path_buf()).filter(|path| path.is_file());
    (contents.camera, contents.times_ns) = (Some(camera), times_ns);
    Ok(contents)
}

fn tracking(root: &Path, sequence: Option<&str>, camera: u8) -> Result<Contents> {
    let cameras = existing(root, format!("image_{camera:02}"))?;
    let sequence = match sequence {
        Some(sequence) => sequence.to_owned(),
        None => {
            let mut known = folders(&cameras)?;
            match (known.pop(), known.is_empty()) {
                (Some(only), true) => only,
                (None, _) => return Err(Error::input(&cameras, "holds no sequences")),
                (Some(last), false) => {
                    known.push(last);
                    return Err(Error::Usage(format!(
                        "{} holds several sequences; choose one with --sequence: {}",
                        cameras.display(),
                        known.join(", ")
                    )));
                }
            }
        }
    };
    let images = cameras.join(&sequence);
    if !images.is_dir() {
        let known = folders(&cameras)?.join(", ");
        return Err(Error::input(&cameras, format!("has no sequence `{sequence}`; there are: {known}")));
    }
    let calibration = root.join("calib").join(format!("{sequence}.txt"));
    let mut contents = Contents::of_folder(&images)?;
    contents.calibration = Some(calibration).filter(|path| path.is_file());
    (contents.camera, contents.sequence) = (Some(camera), Some(sequence));
    Ok(contents)
}

fn folders(path: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(path).map_err(Error::io(path))? {
        let entry = entry.map_err(Error::io(path))?;
        if entry.path().is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}

fn first_camera(root: &Path, prefix: &str, digits: usize) -> Result<u8> {
    (0..4)
        .find(|camera| root.join(format!("{prefix}{camera:0digits$}")).is_dir())
        .ok_or_else(|| Error::input(root, format!("has no folder {prefix}{:0digits$}", 0)))
}

fn existing(root: &Path, name: String) -> Result<PathBuf> {
    let path = root.join(&name);
    if path.is_dir() {
        return Ok(path);
    }
    Err(Error::input(root, format!("has no folder {name}; choose another camera with --camera")))
}

/// Reads times \[ns\]: seconds a line (odometry) or dates (raw). Relative to the first.
fn read_times(path: &Path) -> Result<Vec<i64>> {
    let file = TextFile::read(path)?;
    let mut times = Vec::new();
    for row in file.rows() {
        let seconds = match row.fields.len() {
            1 => row.number(0, "seconds")?,
            _ => clock_seconds(row.fields[1]).ok_or_else(|| row.error("a time HH:MM:SS.s", row.fields[1]))?,
        };
        if !(0.0..=4e9).contains(&seconds) {
            return Err(row.error("a time from 0 to 4e9 s", seconds));
        }
        times.push((seconds * 1e9).round() as i64);
    }
    let first = times.first().copied().unwrap_or(0);
    let mut day_ns = 0;
    let mut last = 0;
    for time in &mut times {
        *time += day_ns - first;
        // A drive over midnight.
        if *time < last - 43_200_000_000_000 {
            day_ns += 86_400_000_000_000;
            *time += 86_400_000_000_000;
        }
        last = *time;
    }
    Ok(times)
}

fn clock_seconds(text: &str) -> Option<f64> {
    let mut parts = text.split(':');
    let mut next = || parts.next()?.parse::<f64>().ok();
    Some(next()? * 3600.0 + next()? * 60.0 + next()?)
}
