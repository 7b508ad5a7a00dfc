//! Summary of an input, for `inspect` and for the record of a run.

use std::path::Path;

use motorcade_geometry::robust::upper_median_by;
use motorcade_geometry::{Distortion, PinholeCamera};

use crate::calibration::Calibration;
use crate::fnv::Fnv;
use crate::input::Input;
use crate::source::{Format, Store};

/// Summary of a recognised input. Lengths in pixels, times in seconds.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Kind of input.
    pub format: Format,
    /// Sequence name in a KITTI tracking split.
    pub sequence: Option<String>,
    /// Camera of a KITTI rig.
    pub camera: Option<u8>,
    /// Selected frames, gaps included.
    pub frames: usize,
    /// First and last selected number.
    pub numbers: (u64, u64),
    /// From the first to the last selected frame \[s\].
    pub duration_s: f64,
    /// Median interval between two frames \[s\].
    pub interval_s: f64,
    /// Shortest and longest interval \[s\].
    pub intervals_s: (f64, f64),
    /// Frame rate that was taken because none is given \[1/s\].
    pub assumed_fps: Option<f64>,
    /// Width \[px\].
    pub width: u32,
    /// Height \[px\].
    pub height: u32,
    /// Turn to the left by which a video asks to be shown \[°\]: its frames are turned so, and are to be calibrated so. Absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_deg: Option<i32>,
    /// True for colour.
    pub colour: bool,
    /// Dialect of the calibration file, when there is one.
    pub calibration: Option<&'static str>,
    /// fx, fy, cx, cy of the undistorted frames \[px\].
    pub intrinsics_px: Option<[f64; 4]>,
    /// Coefficients in OpenCV's order when frames are undistorted on input: k1, k2, p1, p2, k3 where `lens` is absent.
    pub distortion: Option<Vec<f64>>,
    /// The lens, when frames are resampled to another camera matrix or its model is not radial-tangential.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensSummary>,
    /// Origin of cam0 in the camera \[m\], for KITTI.
    pub camera_from_cam0_m: [f64; 3],
    /// Missing numbers.
    pub gaps: Vec<u64>,
    /// Files left out because another file has their number.
    pub duplicates: Vec<String>,
    /// Files left out because they have no number.
    pub unnumbered: Vec<String>,
    /// Fingerprint of the selected input: names, sizes, times, calibration (64-bit FNV-1a, hexadecimal).
    pub input_hash: String,
}

/// A lens and the pinhole its frames are resampled to.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct LensSummary {
    /// radial-tangential, rational or fisheye.
    pub model: &'static str,
    /// fx, fy, cx, cy of the frames as they come in \[px\].
    pub intrinsics_px: [f64; 4],
    /// Horizontal and vertical view of the undistorted frames \[°\].
    pub view_deg: (f64, f64),
}

impl LensSummary {
    fn of(calibration: &Calibration, pinhole: &PinholeCamera) -> Option<Self> {
        let from = [calibration.fx, calibration.fy, calibration.cx, calibration.cy];
        let plain = matches!(calibration.distortion, Distortion::RadialTangential(_));
        let (horizontal, vertical) = pinhole.field_of_view_rad();
        (!plain || from != intrinsics(pinhole)).then(|| Self {
            model: calibration.distortion.model(),
            intrinsics_px: from,
            view_deg: (horizontal.to_degrees(), vertical.to_degrees()),
        })
    }
}

/// Duration and intervals of a drive; zeros for fewer than two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTimes {
    /// From the first to the last frame \[s\].
    pub duration_s: f64,
    /// Median interval between two frames \[s\].
    pub interval_s: f64,
    /// Shortest and longest interval \[s\].
    pub intervals_s: (f64, f64),
}

impl FrameTimes {
    /// From the times of the frames in their order \[ns\].
    pub fn of(times_ns: &[i64]) -> Self {
        let seconds = |ns: Option<i64>| ns.map_or(0.0, |ns| ns as f64 * 1e-9);
        let mut intervals_ns: Vec<i64> = times_ns.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let (shortest, longest) = (intervals_ns.iter().min().copied(), intervals_ns.iter().max().copied());
        Self {
            duration_s: seconds(times_ns.last().zip(times_ns.first()).map(|(last, first)| last - first)),
            interval_s: seconds(upper_median_by(&mut intervals_ns, i64::cmp)),
            intervals_s: (seconds(shortest), seconds(longest)),
        }
    }
}

fn intrinsics(camera: &PinholeCamera) -> [f64; 4] {
    [camera.fx, camera.fy, camera.cx, camera.cy]
}

impl Summary {
    pub(crate) fn of(input: &Input) -> Self {
        let survey = &input.survey;
        let calibration = input.calibration.as_ref().map(|(_, calibration)| calibration);
        let (first, last) = (input.slots.first(), input.slots.last());
        let times_ns: Vec<i64> = input.slots.iter().map(|slot| slot.timestamp_ns).collect();
        let times = FrameTimes::of(&times_ns);
        let shift = calibration.map(|c| c.camera_from_cam0.translation()).unwrap_or_default();
        let names = |paths: &[std::path::PathBuf]| paths.iter().map(|path| name(path)).collect();
        Self {
            format: survey.format,
            sequence: survey.contents.sequence.clone(),
            camera: survey.contents.camera,
            frames: input.slots.len(),
            numbers: (first.map_or(0, |s| s.number), last.map_or(0, |s| s.number)),
            duration_s: times.duration_s,
            interval_s: times.interval_s,
            intervals_s: times.intervals_s,
            assumed_fps: input.assumed_fps,
            width: input.size.0,
            height: input.size.1,
            rotation_deg: survey.contents.rotation_deg,
            colour: input.colour,
            calibration: calibration.map(|c| c.dialect),
            intrinsics_px: input.camera.as_ref().map(intrinsics),
            distortion: calibration
                .map(|c| c.distortion)
                .filter(|d| !d.is_none())
                .map(|d| d.coefficients().iter().map(|(_, value)| *value).collect()),
            lens: calibration.zip(input.camera.as_ref()).and_then(|(c, pinhole)| LensSummary::of(c, pinhole)),
            camera_from_cam0_m: shift.into(),
            gaps: survey.gaps.clone(),
            duplicates: names(&survey.contents.listing.duplicates),
            unnumbered: names(&survey.contents.listing.unnumbered),
            input_hash: fingerprint(input).to_string(),
        }
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn fingerprint(input: &Input) -> Fnv {
    let mut hash = Fnv::default();
    for slot in &input.slots {
        hash.add(&slot.number.to_le_bytes());
        hash.add(&slot.timestamp_ns.to_le_bytes());
        if let Some(path) = &slot.path {
            hash.add(name(path).as_bytes());
            hash.add(&std::fs::metadata(path).map_or(0, |m| m.len()).to_le_bytes());
        }
    }
    if let Store::Video(path) = &input.survey.contents.store {
        hash.add(name(path).as_bytes());
        hash.add(&std::fs::metadata(path).map_or(0, |m| m.len()).to_le_bytes());
    }
    let calibration = input.calibration.as_ref().map(|(_, calibration)| calibration.identity());
    hash.add(calibration.map_or("None".to_owned(), |text| format!("Some({text})")).as_bytes());
    if let Store::Live(source) = &input.survey.contents.store {
        hash.add(format!("{source:?}").as_bytes());
    }
    if let Some(masks) = &input.masks {
        masks.describe(&mut |bytes| hash.add(bytes));
    }
    hash
}
