//! Output of a drive as files.

mod csv;
mod kitti;

pub use kitti::{DRIVE_RECORD, WriteOptions, Written};
