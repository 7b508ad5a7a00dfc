//! Focal length and lens of a camera from a drive: bundle adjustment with free intrinsics over turns.
//!
//! ```
//! use image::GrayImage;
//! use motorcade_calibrate::{CalibrateOptions, Calibrator, ViewPrior};
//! use motorcade_odometry::StaticMask;
//!
//! let mut calibrator = Calibrator::new(320, 160, ViewPrior::default(), CalibrateOptions::default());
//! loop {
//!     let mut pass = calibrator.pass();
//!     for k in 0..3 {
//!         pass.push(k * 100_000_000, &GrayImage::new(320, 160), &StaticMask::default());
//!     }
//!     if calibrator.take(pass) {
//!         break;
//!     }
//! }
//! // Black pictures: nothing is known.
//! assert!(calibrator.finish().is_none());
//! ```

mod adjustment;
mod calibrator;
mod estimate;
mod focal_check;
mod focal_check_options;
mod lens;
mod normal_equations;
mod options;
mod pass;
mod prior;
#[cfg(test)]
mod tests;
mod tracks;
mod window;

pub use calibrator::Calibrator;
pub use estimate::LensEstimate;
pub use focal_check::{FocalCheck, FocalCheckState};
pub use focal_check_options::FocalCheckOptions;
pub use lens::Lens;
pub use options::{AdvancedCalibrateOptions, CalibrateOptions, MountingOptions, ViewPrior};
pub use pass::Pass;
