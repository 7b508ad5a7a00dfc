//! An opened input: everything its sequence and its readers share.

use std::path::PathBuf;
use std::sync::Arc;

use motorcade_geometry::PinholeCamera;

use crate::calibration::Calibration;
use crate::live::Live;
use crate::masks::IgnoreMasks;
use crate::source::Slot;
use crate::survey::Survey;
use crate::undistort::Undistortion;

/// An opened input.
#[derive(Clone, Debug)]
pub(crate) struct Input {
    pub survey: Survey,
    pub slots: Vec<Slot>,
    /// Frame rate that is taken because none is given \[1/s\].
    pub assumed_fps: Option<f64>,
    pub size: (u32, u32),
    pub calibration: Option<(PathBuf, Calibration)>,
    pub camera: Option<PinholeCamera>,
    pub undistortion: Option<Undistortion>,
    pub masks: Option<IgnoreMasks>,
    pub colour: bool,
    pub prefetch: usize,
    /// The running source and its selection, for a live one.
    pub live: Option<Arc<Live>>,
}
