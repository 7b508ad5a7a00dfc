//! Runs without frames: a KITTI tracking split with calibration but no images, everything else from files.

use motorcade::FrameInfo;
use motorcade_dataset::{Calibration, Cam0, Fnv, Format, IMAGE_ENDINGS, Summary};
use motorcade_geometry::{Camera, PinholeCamera, Pose};
use motorcade_perception::{Detection, DetectionTable};

use crate::arguments::RunArguments;

/// Most frames of a drive without images: a day at 60 frames a second, nearly.
const MOST_FRAMES: u64 = 5_000_000;
/// Largest frame number, whose time in nanoseconds fits at every frame rate.
const LARGEST_NUMBER: u64 = 50_000_000;

/// A drive known from files only.
pub struct Files {
    /// Intrinsics.
    pub camera: PinholeCamera,
    /// Frames.
    pub frames: Vec<FrameInfo>,
    /// Detections of each frame.
    pub detections: Vec<Vec<Detection>>,
    /// Of the camera that is processed.
    pub camera_from_cam0: Pose<Camera, Cam0>,
    /// Description of the input.
    pub summary: Summary,
}

/// Recognises such a run: trajectory, detections, a sequence, a closed range of frames, and not all of them as images.
///
/// # Errors
/// Calibration or detections that do not read.
pub fn open(arguments: &RunArguments) -> anyhow::Result<Option<Files>> {
    let input = &arguments.input;
    let (Some(sequence), Some(detections), Some(_)) =
        (&input.sequence, &arguments.detections, &arguments.trajectory)
    else {
        return Ok(None);
    };
    let (Some(first), Some(end)) = (input.frames.start, input.frames.end) else { return Ok(None) };
    let camera_number = input.camera.unwrap_or(2);
    let images = input.input.join(format!("image_{camera_number:02}")).join(sequence);
    let there = |n: u64| IMAGE_ENDINGS.iter().any(|e| images.join(format!("{n:06}.{e}")).exists());
    if (first..end).all(there) || first >= end {
        return Ok(None);
    }
    if end - first > MOST_FRAMES || end > LARGEST_NUMBER {
        let problem =
            format!("--frames {first}..{end}: at most {MOST_FRAMES} frames, numbered up to {LARGEST_NUMBER}");
        return Err(motorcade::Error::Config(problem).into());
    }
    let path = input.calibration.clone().unwrap_or_else(|| input.input.join(format!("calib/{sequence}.txt")));
    let calibration = Calibration::read(&path, Some(camera_number))?;
    let table = DetectionTable::read(detections)?;
    let numbers: Vec<u64> = (first..end).step_by(input.stride.max(1)).collect();
    let boxes: Vec<_> = numbers.iter().map(|n| table.of_frame(*n).to_vec()).collect();
    // Without an image its size is where the boxes end, at least twice the principal point.
    let reach = |f: fn(&motorcade_perception::BoundingBox) -> f64| {
        boxes.iter().flatten().map(|d| f(&d.bbox)).fold(0.0, f64::max)
    };
    let (width, height) = calibration.size.unwrap_or((
        (reach(|b| b.x2) + 1.0).max(2.0 * calibration.cx).ceil() as u32,
        (reach(|b| b.y2) + 1.0).max(2.0 * calibration.cy).ceil() as u32,
    ));
    let camera = calibration.pinhole(&path, width, height)?;
    if let Some(fps) = input.fps.filter(|fps| !(0.01..=1e4).contains(fps)) {
        let problem = format!("frames per second (--fps) must lie in [0.01, 10000], got {fps}");
        return Err(motorcade::Error::Config(problem).into());
    }
    // KITTI: ten frames a second.
    let period_ns = (1e9 / input.fps.or(calibration.fps).unwrap_or(10.0)) as i64;
    let frame =
        |number: &u64| FrameInfo { number: *number, timestamp_ns: *number as i64 * period_ns, problem: None };
    let frames: Vec<FrameInfo> = numbers.iter().map(frame).collect();
    let summary = Summary {
        rotation_deg: None,
        format: Format::KittiTracking,
        sequence: Some(sequence.clone()),
        camera: Some(camera_number),
        frames: frames.len(),
        numbers: (first, end - 1),
        duration_s: (frames.len().saturating_sub(1)) as f64 * period_ns as f64 * 1e-9,
        interval_s: period_ns as f64 * 1e-9,
        intervals_s: (period_ns as f64 * 1e-9, period_ns as f64 * 1e-9),
        assumed_fps: None,
        width,
        height,
        colour: false,
        calibration: Some(calibration.dialect),
        intrinsics_px: Some([camera.fx, camera.fy, camera.cx, camera.cy]),
        distortion: None,
        lens: None,
        camera_from_cam0_m: calibration.camera_from_cam0.translation().into(),
        gaps: Vec::new(),
        duplicates: Vec::new(),
        unnumbered: Vec::new(),
        input_hash: Fnv::of(
            format!("files only: {sequence} {first}..{end} {}", calibration.identity()).as_bytes(),
        )
        .to_string(),
    };
    let camera_from_cam0 = calibration.camera_from_cam0;
    Ok(Some(Files { camera, frames, detections: boxes, camera_from_cam0, summary }))
}
