//! A drive: its frames, its camera, its numbering.

use std::path::Path;
use std::sync::Arc;

use motorcade_geometry::{Camera, PinholeCamera, Pose};

use crate::calibration::{Calibration, Cam0, FPS_RANGE, HEIGHT_RANGE_M};
use crate::error::{Error, Result};
use crate::frame::Pixels;
use crate::input::Input;
use crate::inspect::Summary;
use crate::live::Live;
use crate::masks::IgnoreMasks;
use crate::metadata::{self, FocalMetadata};
use crate::options::SequenceOptions;
use crate::source::{Format, Slot, Store, decode, video::VideoReader};
use crate::stream::{Decoder, Frames};
use crate::survey::{Survey, survey};
use crate::turned;
use crate::undistort::Undistortion;

/// Height of the cameras of the KITTI car above the road \[m\] (Geiger et al., CVPR 2012).
pub const KITTI_HEIGHT_M: f64 = 1.65;

/// An opened drive: its first frame is readable and its calibration fits.
#[derive(Clone, Debug)]
pub struct Sequence {
    input: Arc<Input>,
}

impl Sequence {
    /// Opens `path` and reads its first selected frame.
    ///
    /// # Errors
    /// An input that is not recognised, holds no frames, whose first frame does not read or whose calibration is
    /// unreadable or of another size.
    pub fn open(path: &Path, options: &SequenceOptions) -> Result<Self> {
        if options.stride == 0 {
            return Err(Error::Usage("the stride must be at least 1".into()));
        }
        if let Some(fps) = options.fps.filter(|fps| !FPS_RANGE.contains(fps)) {
            return Err(Error::Usage(format!(
                "frames per second (--fps) must lie in [0.01, 10000], got {fps}"
            )));
        }
        let format = options.format.map_or_else(|| Format::recognise(path), Ok)?;
        let survey = survey(path, format, options)?;
        let calibration = match &survey.calibration {
            Some(file) => Some((file.clone(), Calibration::read(file, survey.contents.camera)?)),
            None => None,
        };
        let calibrated_fps = calibration.as_ref().and_then(|(_, c)| c.fps);
        let (slots, live, first) = match &survey.contents.store {
            Store::Live(source) => {
                let (live, first) = Live::open(path, source, options)?;
                (Vec::new(), Some(Arc::new(live)), first)
            }
            _ => {
                let slots = select(path, &survey, options, calibrated_fps)?;
                let first = first_pixels(&survey, &slots[0])?;
                (slots, None, first)
            }
        };
        let assumed_fps = survey.assumed_fps(options.fps, calibrated_fps);
        let size = first.size();
        let (camera, undistortion) = match &calibration {
            Some((file, calibration)) => {
                let (pinhole, undistortion) = resampling(file, calibration, size)?;
                (Some(pinhole), undistortion)
            }
            None => (None, None),
        };
        let masks = options.ignore.as_deref().map(IgnoreMasks::open).transpose()?;
        if let Some(masks) = &masks {
            masks.get(slots.first().map_or(0, |slot| slot.number), size)?;
        }
        let colour = matches!(first, Pixels::Rgb(_));
        let prefetch = options.prefetch;
        let input = Input {
            survey,
            slots,
            assumed_fps,
            size,
            calibration,
            camera,
            undistortion,
            masks,
            colour,
            prefetch,
            live,
        };
        Ok(Self { input: Arc::new(input) })
    }

    /// The same frames with another calibration, as if read from `file`.
    ///
    /// # Errors
    /// A calibration for another size, or a lens that cannot be.
    pub fn calibrated(&self, file: &Path, calibration: Calibration) -> Result<Self> {
        let (pinhole, undistortion) = resampling(file, &calibration, self.size())?;
        let mut input = Input::clone(&self.input);
        (input.camera, input.undistortion) = (Some(pinhole), undistortion);
        input.calibration = Some((file.to_path_buf(), calibration));
        Ok(Self { input: Arc::new(input) })
    }

    /// Format of the input.
    pub fn format(&self) -> Format {
        self.input.survey.format
    }
    /// The frame rate that is taken because none is given \[1/s\].
    pub fn assumed_fps(&self) -> Option<f64> {
        self.input.assumed_fps
    }
    /// True for a source without a known end, whose frames come as they are taken and only once.
    pub fn is_live(&self) -> bool {
        self.input.live.is_some()
    }
    /// Number of selected frames; `None` where it is not known before the end.
    pub fn known_len(&self) -> Option<usize> {
        (!self.is_live()).then(|| self.len())
    }
    /// Problems of a live source, once its frames have ended: times that do not increase, a connection that broke off.
    pub fn live_problems(&self) -> Vec<String> {
        self.input.live.as_deref().map(Live::problems).unwrap_or_default()
    }
    /// Number of selected frames, gaps and unreadable ones included; 0 of a live source.
    #[expect(clippy::len_without_is_empty, reason = "an empty sequence does not open")]
    pub fn len(&self) -> usize {
        self.input.slots.len()
    }
    /// The input's own frame numbers, row by row.
    pub fn numbers(&self) -> impl ExactSizeIterator<Item = u64> + '_ {
        self.input.slots.iter().map(|slot| slot.number)
    }
    /// Times \[ns\], row by row.
    pub fn timestamps_ns(&self) -> impl ExactSizeIterator<Item = i64> + '_ {
        self.input.slots.iter().map(|slot| slot.timestamp_ns)
    }
    /// Width and height of the frames \[px\].
    pub fn size(&self) -> (u32, u32) {
        self.input.size
    }
    /// The pinhole camera of the undistorted frames.
    ///
    /// # Errors
    /// When no calibration was given and the input has none.
    pub fn camera(&self) -> Result<PinholeCamera> {
        self.input.camera.ok_or_else(|| {
            let root = self.input.survey.root.display();
            Error::Usage(format!(
                "{root} has no calibration; give one with --calibration FILE (TOML, KITTI calib.txt, OpenCV, ROS, ORB-SLAM or Kalibr YAML), \
                 or find it by a drive with turns: motorcade calibrate {root} --out camera.toml"
            ))
        })
    }
    /// The calibration file's content.
    pub fn calibration(&self) -> Option<&Calibration> {
        self.input.calibration.as_ref().map(|(_, calibration)| calibration)
    }
    /// Reason why the calibration may not be that of the pictures, which the container of a video asks to turn.
    pub fn turned_calibration(&self) -> Option<String> {
        let turn_deg = self.input.survey.contents.rotation_deg?;
        let (file, calibration) = self.input.calibration.as_ref()?;
        turned::problem(file, calibration, turn_deg, self.size())
    }
    /// Focal length that the files state beside their pixels: EXIF of the first and last picture, tags of a video. `None` where they state
    /// none, where the lens was zoomed in between, or where pictures were cropped after they were taken.
    pub fn focal_metadata(&self) -> Option<FocalMetadata> {
        metadata::focal(&self.input.survey.contents.store, &self.input.slots, self.size())
    }
    /// `camera_from_cam0` of a KITTI rig, to write results in rectified cam0 coordinates; identity elsewhere.
    pub fn camera_from_cam0(&self) -> Pose<Camera, Cam0> {
        self.calibration().map_or_else(Pose::identity, |calibration| calibration.camera_from_cam0)
    }
    /// Height of the camera above the road \[m\]: the one given, else the calibration's, else 1.65 for KITTI.
    ///
    /// # Errors
    /// A height that is not positive, or an unknown height of input that is not KITTI's.
    pub fn height_m(&self, given: Option<f64>) -> Result<f64> {
        let known = given.or_else(|| self.calibration().and_then(|calibration| calibration.height_m));
        match known {
            Some(height) if HEIGHT_RANGE_M.contains(&height) => Ok(height),
            Some(height) => {
                Err(Error::Usage(format!("the camera height (--height) must lie in [0.01, 1000] m, got {height}")))
            }
            None if self.format().is_kitti() => Ok(KITTI_HEIGHT_M),
            None => Err(Error::Usage(
                "the height of the camera above the road is not known; give it with --height METRES, it sets the scale, or --height auto".into(),
            )),
        }
    }
    /// Summary of the input.
    pub fn summary(&self) -> Summary {
        Summary::of(&self.input)
    }
    /// The frames in order. An unavailable frame is an `Err` item in its place, and the iteration continues.
    pub fn frames(&self) -> Frames {
        self.frames_from(0)
    }
    /// The frames from a row on. Pictures before it are not read; a video is decoded up to there. A live source begins where it is.
    pub fn frames_from(&self, row: usize) -> Frames {
        Frames::start(Decoder::new(Arc::clone(&self.input), row), self.input.prefetch)
    }
}

/// The pinhole of a calibration, and how frames are resampled to it where they are.
fn resampling(
    file: &Path,
    calibration: &Calibration,
    (width, height): (u32, u32),
) -> Result<(PinholeCamera, Option<Undistortion>)> {
    let distorted = calibration.distorted(file, width, height)?;
    let pinhole = calibration.pinhole(file, width, height)?;
    let resampled = !distorted.distortion().is_none() || pinhole != *distorted.matrix();
    Ok((pinhole, resampled.then(|| Undistortion::new(&distorted, &pinhole))))
}

/// Slots selected by number and stride.
fn select(
    path: &Path,
    survey: &Survey,
    options: &SequenceOptions,
    calibrated_fps: Option<f64>,
) -> Result<Vec<Slot>> {
    let slots = survey.slots(options.fps, calibrated_fps)?;
    let (first, last) = (slots.first().map_or(0, |s| s.number), slots.last().map_or(0, |s| s.number));
    let wanted = slots.into_iter().filter(|slot| options.frames.contains(slot.number));
    let chosen: Vec<Slot> = wanted.step_by(options.stride).collect();
    if chosen.is_empty() {
        return Err(Error::Usage(format!(
            "no frame of {} lies in {}; its numbers run from {first} to {last}",
            path.display(),
            options.frames
        )));
    }
    Ok(chosen)
}

fn first_pixels(survey: &Survey, slot: &Slot) -> Result<Pixels> {
    match (&survey.contents.store, &slot.path) {
        (Store::Video(path), _) => Ok(Pixels::Rgb(VideoReader::open(path, None)?.frame(path, slot.number)?)),
        (Store::Files, Some(path)) => decode::read(path),
        (Store::Files | Store::Live(_), _) => Err(Error::input(
            &survey.root,
            format!("has no file for frame {}, the first selected one", slot.number),
        )),
    }
}
