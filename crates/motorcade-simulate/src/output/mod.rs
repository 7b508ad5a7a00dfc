//! Output of a drive as files.

mod csv;
pub(crate) mod detections;
mod kitti;
pub(crate) mod labels;

pub use detections::DetectorOptions;
pub use kitti::{WriteOptions, Written};
