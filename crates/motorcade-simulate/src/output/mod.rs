//! A drive as files.

mod detections;
mod kitti;
mod labels;

pub use detections::DetectorOptions;
pub use kitti::{WriteOptions, Written};
