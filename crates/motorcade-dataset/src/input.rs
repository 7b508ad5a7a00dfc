//! An opened input: everything its sequence and its readers share.

use std::path::PathBuf;

use motorcade_geometry::PinholeCamera;

use crate::calibration::Calibration;
use crate::masks::IgnoreMasks;
use crate::source::Slot;
use crate::survey::Survey;
use crate::undistort::Undistortion;

/// An opened input.
#[derive(Debug)]
pub(crate) struct Input {
    pub survey: Survey,
    pub slots: Vec<Slot>,
    pub size: (u32, u32),
    pub calibration: Option<(PathBuf, Calibration)>,
    pub camera: Option<PinholeCamera>,
    pub undistortion: Option<Undistortion>,
    pub masks: Option<IgnoreMasks>,
    pub colour: bool,
    pub prefetch: usize,
}
