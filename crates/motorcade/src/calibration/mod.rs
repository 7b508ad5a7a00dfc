//! The camera of a drive that nobody calibrated.

mod boxes;
mod mounting;
mod prior;

use std::path::Path;

use image::GrayImage;
use motorcade_calibrate::{CalibrateOptions, Calibrator, LensEstimate, Pass};
use motorcade_dataset::{Calibration, Sequence};
use motorcade_geometry::{Distortion, Pose, RadialTangential};
use motorcade_odometry::StaticMask;
use motorcade_perception::{FixedRegionOptions, FixedRegions, Perception};

use crate::error::{Error, Result};
use crate::fixed_parts::FixedParts;
use crate::progress::Progress;
use crate::run::surveyed;
use boxes::VehicleBoxes;
pub use mounting::Mounting;
pub use prior::{FocalPrior, PriorOrigin};

/// A camera estimated from its drive.
#[derive(Clone, Debug)]
pub struct CameraCalibration {
    /// Lens and standard deviations.
    pub lens: LensEstimate,
    /// Width and height of the pictures \[px\].
    pub size: (u32, u32),
    /// Prior of the focal length.
    pub prior: FocalPrior,
    /// Angles of its mounting; `None` where the road was not seen.
    pub mounting: Option<Mounting>,
    /// Pixels (255) that are fixed to the camera; `None` where nothing was found.
    pub fixed: Option<GrayImage>,
    /// Frames used.
    pub frames: usize,
}

/// Finds the lens of the camera by its drive, opened with [`uncalibrated`](motorcade_dataset::SequenceOptions::uncalibrated); vehicles that
/// `perception` finds are left out. `None` when the progress was cancelled.
///
/// # Errors
/// A drive that does not determine the focal length: too short, or straight. A detector that fails.
pub fn calibrate(
    sequence: &Sequence,
    perception: Perception,
    prior: FocalPrior,
    options: &CalibrateOptions,
    progress: &dyn Progress,
) -> Result<Option<CameraCalibration>> {
    let (width, height) = sequence.size();
    let mut calibrator = Calibrator::new(width, height, prior.view, *options);
    let frames = sequence.len().min(options.most_frames);
    let fixed_options = FixedRegionOptions::default();
    let mut regions = FixedRegions::new(fixed_options);
    for image in surveyed(sequence, &fixed_options, progress) {
        regions.observe(&image);
    }
    let mask = regions.mask(&prior.view.camera(width, height));
    let mut fixed = FixedParts::new(true, fixed_options);
    fixed.settle(mask.clone());
    let mut boxes = VehicleBoxes::new(perception);
    loop {
        progress.begin("calibration", Some(frames));
        let mut pass = calibrator.pass();
        if !push(sequence, frames, &mut pass, &fixed, &mut boxes, progress)? {
            return Ok(None);
        }
        if calibrator.take(pass) {
            break;
        }
    }
    let estimate = calibrator.finish();
    let Some(lens) = estimate.clone().filter(|lens| lens.focal_sigma() <= options.most_focal_sigma) else {
        return Err(Error::Input(undetermined(estimate.as_ref())));
    };
    let mut found =
        CameraCalibration { lens, size: (width, height), prior, mounting: None, fixed: mask, frames };
    let calibrated = sequence.calibrated(Path::new("camera.toml"), found.calibration())?;
    found.mounting = mounting::of(&calibrated, frames, &options.advanced.mounting, progress)?;
    Ok((!progress.cancelled()).then_some(found))
}

impl CameraCalibration {
    /// As a calibration of the frames.
    pub fn calibration(&self) -> Calibration {
        let lens = &self.lens.lens;
        Calibration {
            dialect: "estimated from the drive",
            fx: lens.focal_px,
            fy: lens.focal_px,
            cx: lens.cx,
            cy: lens.cy,
            size: Some(self.size),
            distortion: Distortion::RadialTangential(RadialTangential { k1: lens.k1, ..Default::default() }),
            view_deg: None,
            fps: None,
            height_m: None,
            readout_ms: 0.0,
            focal_sigma: Some(self.lens.focal_sigma()),
            camera_from_cam0: Pose::identity(),
        }
    }

    /// The calibration as TOML, with what else was found as comments.
    pub fn to_toml(&self) -> String {
        let lens = &self.lens;
        let mut text = format!(
            "# Estimated by motorcade from {} frames: the camera turned by {:.0} degrees in {} keyframes; {} corners, {:.2} px off in the \
             median.\n# Square pixels. The height above the road cannot be estimated from the pictures: add height_m, or run with --height.\n",
            self.frames,
            lens.turned_rad.to_degrees(),
            lens.keyframes,
            lens.corners,
            lens.median_error_px
        );
        if let Some(prior) = self.prior.describe(self.size.0) {
            text += &format!("# Known before the drive: {prior}.\n");
        }
        for line in self.mounting.iter().flat_map(Mounting::lines) {
            text += &format!("# {line}\n");
        }
        text + &self.calibration().to_toml(lens.sigmas())
    }

    /// The result in words, a line each.
    pub fn describe(&self) -> Vec<String> {
        let ([focal, k1, cx, cy], lens) = (self.lens.sigmas(), &self.lens.lens);
        let view = 2.0 * (0.5 * f64::from(self.size.0) / lens.focal_px).atan();
        let mut lines = vec![
            format!(
                "focal length     {:.1} ± {focal:.1} px ({:.1} %), {:.1} degrees across",
                lens.focal_px,
                100.0 * self.lens.focal_sigma(),
                view.to_degrees()
            ),
            format!("principal point  {:.1} ± {cx:.1}, {:.1} ± {cy:.1} px", lens.cx, lens.cy),
            format!("distortion k1    {:.3} ± {k1:.3}", lens.k1),
        ];
        lines.extend(self.prior.describe(self.size.0).map(|prior| format!("known before     {prior}")));
        match &self.mounting {
            Some(mounting) => lines.extend(mounting.lines()),
            None => {
                lines.push("mounting         not known: the road was measured in too few frames".to_owned())
            }
        }
        if let Some(fixed) = &self.fixed {
            let share = fixed.pixels().filter(|p| p.0[0] != 0).count() as f64 / fixed.len().max(1) as f64;
            lines.push(format!("fixed to camera  {:.1} % of the picture", 100.0 * share));
        }
        lines
    }
}

/// Why the drive does not determine the focal length, and which one would.
fn undetermined(lens: Option<&LensEstimate>) -> String {
    let seen = lens.map_or_else(
        || "the camera hardly moves, or too little is seen to follow it".to_owned(),
        |lens| {
            format!(
                "it came out as {:.0} px ± {:.0} %, with {:.0} degrees of turning",
                lens.lens.focal_px,
                100.0 * lens.focal_sigma(),
                lens.turned_rad.to_degrees()
            )
        },
    );
    format!(
        "this drive does not determine the focal length: {seen}. Every focal length explains straight motion; take a drive with a few turns at \
         crossings (--frames chooses a part), or state the field of view with --view-deg"
    )
}

/// One pass over the frames; false when cancelled.
fn push(
    sequence: &Sequence,
    count: usize,
    pass: &mut Pass,
    fixed: &FixedParts,
    boxes: &mut VehicleBoxes,
    progress: &dyn Progress,
) -> Result<bool> {
    let stop = || progress.cancelled();
    let mut frames = sequence.frames();
    for row in 0..count {
        let Some(frame) = frames.next_unless(&stop) else { break };
        match frame {
            Ok(frame) => {
                let vehicles = boxes.of(row, &frame)?;
                let ignore = fixed.with(frame.ignore.as_ref());
                let mask = StaticMask { boxes: vehicles, ignore: ignore.as_deref(), ..StaticMask::default() };
                pass.push(frame.timestamp_ns, &frame.gray(), &mask);
            }
            Err(bad) => pass.skip(bad.timestamp_ns),
        }
        progress.advance(row + 1);
        if stop() {
            return Ok(false);
        }
    }
    Ok(!stop())
}
