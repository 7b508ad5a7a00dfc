//! A pass over the frames of a drive.

use image::GrayImage;
use motorcade_odometry::{Odometry, OdometryOptions, StaticMask};

use crate::lens::Lens;
use crate::options::CalibrateOptions;
use crate::tracks::TrackRecorder;
use crate::window::Window;

/// A pass over the frames of a drive with a lens that is about right.
pub struct Pass {
    lens: Lens,
    odometry: Odometry,
    recorder: TrackRecorder,
}

impl Pass {
    pub(crate) fn new(lens: Lens, width: u32, height: u32, options: &CalibrateOptions) -> Self {
        let mut wide = OdometryOptions::default();
        // With a wrong lens a static point is off by more than the noise; what is left out here is missed by the adjustment.
        wide.advanced.window.outlier_px = options.advanced.outlier_px;
        wide.advanced.pose.inlier_px = options.advanced.outlier_px;
        wide.advanced.pose.kernel_px = 2.0 * options.advanced.kernel_px;
        wide.advanced.policy.two_view_noise_px = 2.0 * options.advanced.kernel_px;
        let odometry = Odometry::new(lens.pinhole(width, height), wide);
        Self { lens, odometry, recorder: TrackRecorder::default() }
    }

    /// Takes a frame as the camera made it, without vehicles and what is fixed to the camera.
    pub fn push(&mut self, timestamp_ns: i64, image: &GrayImage, mask: &StaticMask<'_>) {
        self.odometry.process(timestamp_ns, image, mask);
        self.recorder.observe(&self.odometry);
    }

    /// A frame that is missing or unreadable.
    pub fn skip(&mut self, timestamp_ns: i64) {
        self.odometry.skip(timestamp_ns);
    }

    /// Stretches of keyframes, those in which the camera turns most first.
    pub(crate) fn windows(self, options: &CalibrateOptions) -> Vec<Window> {
        let Self { lens, odometry, recorder } = self;
        let mut windows = Vec::new();
        for map in &recorder.finish(odometry) {
            let total = map.poses.len();
            let count = total.div_ceil(options.advanced.window_keyframes).max(1);
            let ranges = (0..count).map(|k| total * k / count..total * (k + 1) / count);
            let long_enough = ranges.filter(|range| range.len() >= options.advanced.least_keyframes);
            windows.extend(
                long_enough
                    .filter_map(|range| Window::new(map, range, &lens, options.advanced.least_corners)),
            );
        }
        windows.sort_by(|a, b| b.turn_rad().total_cmp(&a.turn_rad()));
        windows.truncate(options.most_windows);
        windows
    }
}
