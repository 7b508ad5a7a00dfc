//! A folder in the layout of KITTI tracking.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use motorcade_dataset::{Label, write_kitti};
use rayon::prelude::*;

use super::csv;
use crate::drive::Drive;
use crate::error::{Error, Result};
use crate::measure::{KeypointMeasurement, KeypointOptions, MeasureOptions};
use crate::measure::{detections, labels};
use crate::render::{Picture, Renderer};

/// Name of the record of simulated data, which lists its files.
pub const DRIVE_RECORD: &str = "simulation.json";

/// Options of the output.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// Name of the sequence, `0000` by default.
    pub sequence: String,
    /// `road_masks/<sequence>`: 255 where all of a pixel is carriageway.
    pub road_masks: bool,
    /// `depth/<sequence>`: 16 bits, 256 a metre, 0 for nothing, as KITTI's.
    pub depth: bool,
    /// `keypoints/<sequence>.csv`: see [`KeypointMeasurement`](crate::KeypointMeasurement); columns
    /// `frame,track_id,layout,index,name,x_px,y_px,confidence`.
    pub keypoints: Option<KeypointOptions>,
    /// `instance/<sequence>`: 16 bits, 0 for the world, track + 1 for vehicles.
    pub instance: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self { sequence: "0000".to_owned(), road_masks: true, depth: false, keypoints: None, instance: false }
    }
}

/// Paths of the written files.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The split, to be given to `motorcade run` as its input.
    pub training: PathBuf,
    /// Name of the sequence in it.
    pub sequence: String,
    /// Detections of all frames.
    pub detections: PathBuf,
    /// Folder of road masks, when asked for.
    pub road_masks: Option<PathBuf>,
    /// Table of keypoints, when asked for.
    pub keypoints: Option<PathBuf>,
    /// Labelled boxes.
    pub labels: usize,
}

impl Written {
    /// The same after the folder `from` was moved to `to`.
    #[must_use]
    pub fn moved(self, from: &Path, to: &Path) -> Self {
        let moved = |path: &Path| to.join(path.strip_prefix(from).unwrap_or(path));
        Self {
            training: moved(&self.training),
            detections: moved(&self.detections),
            road_masks: self.road_masks.as_deref().map(moved),
            keypoints: self.keypoints.as_deref().map(moved),
            ..self
        }
    }
}

impl Drive {
    /// Renders the drive into `folder/training` in the shape of KITTI tracking: `image_02`, `calib`, `label_02`,
    /// `gt_poses` (`world_from_cam0`), `detections`, and masks and maps as asked for. Camera 2 sits at camera 0.
    /// `progress` is called with the number of frames done, from several threads.
    ///
    /// # Errors
    /// Folders and files that cannot be written, and sequence names that are no plain file names.
    pub fn write_kitti(
        &self,
        folder: &Path,
        options: &WriteOptions,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Written> {
        self.write_kitti_until(folder, options, progress, &|| false)
    }

    /// As [`write_kitti`](Self::write_kitti), until `cancelled` says so.
    ///
    /// # Errors
    /// Those, and [`Error::Cancelled`]; the folder then holds a part of the drive.
    pub fn write_kitti_until(
        &self,
        folder: &Path,
        options: &WriteOptions,
        progress: &(dyn Fn(usize) + Sync),
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Written> {
        let folders = Folders::create(folder, options, true)?;
        let renderer = Renderer::new(self);
        let done = AtomicUsize::new(0);
        let frame = |i: usize| -> Result<FrameRecord> {
            if cancelled() {
                return Err(Error::Cancelled);
            }
            let Some(picture) = renderer.render(i) else { return Ok(FrameRecord::default()) };
            folders.write(i, &picture)?;
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            Ok(FrameRecord {
                labels: labels::of_frame(self, i, &picture.views),
                detections: detections::of_frame(self, i, &picture.views),
                keypoints: options
                    .keypoints
                    .map_or_else(Vec::new, |keypoints| self.keypoints_of(i, &picture, &keypoints)),
            })
        };
        let frames: Vec<FrameRecord> = (0..self.len()).into_par_iter().map(frame).collect::<Result<_>>()?;
        let mut keypoints = None;
        if options.keypoints.is_some() {
            let rows = csv::keypoints(frames.iter().flat_map(|f| &f.keypoints));
            let path = folders.table("keypoints", options)?;
            write_text(&path, &rows)?;
            keypoints = Some(path);
        }
        let (labels, detections): (Vec<_>, Vec<_>) =
            frames.into_iter().map(|f| (f.labels, f.detections)).unzip();
        let written = self.write_truth(&folders, options, &labels.concat(), &detections.concat())?;
        Ok(Written { keypoints, ..written })
    }

    /// Writes the [measurements](Drive::measure) of the drive, without images: `calib`, `label_02`, `gt_poses` and
    /// `detections` as [`Drive::write_kitti`] does, and the tables `keypoints`, `landmarks`, `points` and `road_matches`,
    /// each a folder with `<sequence>.csv`.
    ///
    /// # Errors
    /// Invalid options, folders and files that cannot be written, and sequence names that are no plain file names.
    pub fn write_geometry(
        &self,
        folder: &Path,
        options: &WriteOptions,
        measure: &MeasureOptions,
    ) -> Result<Written> {
        let all = self.measure(measure)?;
        let folders = Folders::create(folder, options, false)?;
        let tables = [
            ("keypoints", csv::keypoints(all.keypoints.iter())),
            ("landmarks", csv::landmarks(&all)),
            ("points", csv::points(&all)),
            ("road_matches", csv::road_matches(&all)),
        ];
        for (kind, text) in &tables {
            write_text(&folders.table(kind, options)?, text)?;
        }
        let written = self.write_truth(&folders, options, &all.labels, &all.detections)?;
        Ok(Written { keypoints: Some(folders.table("keypoints", options)?), ..written })
    }

    /// Labels, detections, calibration and poses.
    fn write_truth(
        &self,
        folders: &Folders,
        options: &WriteOptions,
        labels: &[Label],
        detections: &[Label],
    ) -> Result<Written> {
        let name = &options.sequence;
        let file = |kind: &str| folders.training.join(kind).join(format!("{name}.txt"));
        write_lines(&file("label_02"), labels.iter())?;
        write_lines(&file("detections"), detections.iter())?;
        self.write_calibration(&file("calib"))?;
        let poses = file("gt_poses");
        let mut out = BufWriter::new(File::create(&poses).map_err(Error::io(&poses))?);
        write_kitti(&mut out, &self.world_from_camera())
            .and_then(|()| out.flush())
            .map_err(Error::io(&poses))?;
        if let Some(poses) = self.first_visit_from_camera() {
            let path = file("gt_first_visit_poses");
            let io = || Error::io(&path);
            path.parent().map_or(Ok(()), fs::create_dir_all).map_err(io())?;
            let mut out = BufWriter::new(File::create(&path).map_err(io())?);
            write_kitti(&mut out, &poses).and_then(|()| out.flush()).map_err(io())?;
        }
        Ok(Written {
            sequence: name.clone(),
            detections: file("detections"),
            road_masks: folders.road.clone(),
            keypoints: None,
            labels: labels.len(),
            training: folders.training.clone(),
        })
    }

    fn write_calibration(&self, path: &Path) -> Result<()> {
        let c = self.camera();
        let projection = [c.fx, 0.0, c.cx, 0.0, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
            .map(|v| format!("{v:.12e}"))
            .join(" ");
        let unit = "1 0 0 0 1 0 0 0 1";
        let mut text: String = (0..4).map(|i| format!("P{i}: {projection}\n")).collect();
        text.push_str(&format!(
            "R_rect {unit}\nTr_velo_cam 0 -1 0 0 0 0 -1 0 1 0 0 0\nTr_imu_velo 1 0 0 0 0 1 0 0 0 0 1 0\n"
        ));
        fs::write(path, text).map_err(Error::io(path))
    }
}

/// Labels and detections of a frame.
#[derive(Default)]
struct FrameRecord {
    labels: Vec<Label>,
    detections: Vec<Label>,
    keypoints: Vec<KeypointMeasurement>,
}

struct Folders {
    training: PathBuf,
    images: Option<PathBuf>,
    road: Option<PathBuf>,
    depth: Option<PathBuf>,
    instance: Option<PathBuf>,
}

impl Folders {
    fn create(folder: &Path, options: &WriteOptions, pictures: bool) -> Result<Self> {
        let name = &options.sequence;
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c)) {
            return Err(Error::Plan(format!(
                "`{name}` is no name for a sequence; use letters, digits, - and _"
            )));
        }
        let training = folder.join("training");
        for kind in ["calib", "label_02", "gt_poses", "detections"] {
            made(training.join(kind))?;
        }
        let asked = |wanted: bool, kind: &str| {
            (wanted && pictures).then(|| made(training.join(kind).join(name))).transpose()
        };
        Ok(Self {
            images: asked(true, "image_02")?,
            road: asked(options.road_masks, "road_masks")?,
            depth: asked(options.depth, "depth")?,
            instance: asked(options.instance, "instance")?,
            training,
        })
    }

    /// Path of a table; creates its folder.
    fn table(&self, kind: &str, options: &WriteOptions) -> Result<PathBuf> {
        Ok(made(self.training.join(kind))?.join(format!("{}.csv", options.sequence)))
    }

    fn write(&self, frame: usize, picture: &Picture) -> Result<()> {
        let (width, height) = picture.rgb.dimensions();
        let name = format!("{frame:06}.png");
        let size = (width, height);
        if let Some(folder) = &self.images {
            png(&folder.join(&name), picture.rgb.as_raw(), size, ExtendedColorType::Rgb8)?;
        }
        if let Some(folder) = &self.road {
            png(&folder.join(&name), picture.road.as_raw(), size, ExtendedColorType::L8)?;
        }
        if let Some(folder) = &self.depth {
            let level = |d: &f32| if d.is_finite() { (256.0 * d).round().min(65535.0) as u16 } else { 0 };
            let bytes: Vec<u8> = picture.depth_m.iter().flat_map(|d| level(d).to_ne_bytes()).collect();
            png(&folder.join(&name), &bytes, size, ExtendedColorType::L16)?;
        }
        if let Some(folder) = &self.instance {
            let bytes: Vec<u8> = picture.instance.as_raw().iter().flat_map(|v| v.to_ne_bytes()).collect();
            png(&folder.join(&name), &bytes, size, ExtendedColorType::L16)?;
        }
        Ok(())
    }
}

fn made(path: PathBuf) -> Result<PathBuf> {
    fs::create_dir_all(&path).map_err(Error::io(&path)).map(|()| path)
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    fs::write(path, text).map_err(Error::io(path))
}

fn png(path: &Path, bytes: &[u8], (width, height): (u32, u32), colour: ExtendedColorType) -> Result<()> {
    let file = BufWriter::new(File::create(path).map_err(Error::io(path))?);
    // Noise does not compress: the fast setting costs a tenth of the time and little space.
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Sub);
    let failed = |source| Error::Image { path: path.to_path_buf(), source };
    encoder.write_image(bytes, width, height, colour).map_err(failed)
}

fn write_lines<'a>(path: &Path, lines: impl Iterator<Item = &'a Label>) -> Result<()> {
    let mut text = String::new();
    for label in lines {
        text.push_str(&label.to_line());
        text.push('\n');
    }
    fs::write(path, text).map_err(Error::io(path))
}
