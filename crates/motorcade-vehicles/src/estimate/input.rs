//! Input of a track's estimation, and the fit of all its boxes.

use motorcade_geometry::PinholeCamera;
use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::Matrix3;

use crate::box_fit::{BoxFit, SingleView};
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::options::VehicleOptions;
use crate::time::independent_views;
use crate::track::{Track, TrackBox};

/// Everything known of one vehicle before its estimation.
pub(super) struct TrackInput<'a> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) grounds: &'a [GroundFrame],
    pub(super) track: &'a Track,
    pub(super) external: &'a ExternalTrack,
    /// External views whose headings are taken; those of `external`, but where their positions and size hold for another class.
    pub(super) external_headings: &'a ExternalTrack,
    /// Size prior of the class, or that of the external views.
    pub(super) prior: SizePrior,
    /// First frame.
    pub(super) start: usize,
    pub(super) options: &'a VehicleOptions,
}

impl<'a> TrackInput<'a> {
    /// The fit of boxes in a frame.
    pub(super) fn box_fit(&self, ground: &'a GroundFrame) -> BoxFit<'a> {
        BoxFit { camera: self.camera, ground, options: &self.options.advanced.box_fit }
    }

    /// Number of independent views among `count` in a range of frames, at most `limit`.
    pub(super) fn independent_views(&self, count: usize, frames: (usize, usize), limit: f64) -> f64 {
        let time_s = |frame: usize| self.grounds.get(frame).map_or(0.0, |g| g.time_s);
        let duration_s = time_s(frames.1) - time_s(frames.0);
        independent_views(count, duration_s, self.options.advanced.correlation_time_s, limit)
    }

    /// Fits every box for the headings (relative to each frame's camera) and a size of this mean and information (3×3), from `earlier` fits on where
    /// there are any, in order of frames.
    pub(super) fn fit_boxes(
        &self,
        headings: &[f64],
        mean: &Dimensions,
        size_information: &Matrix3<f64>,
        earlier: &[(usize, SingleView)],
    ) -> Vec<(usize, SingleView)> {
        let one = |b: &TrackBox| {
            let heading = headings.get(b.frame - self.start)?;
            let fit = self.box_fit(self.grounds.get(b.frame)?);
            let start = fit_in_frame(earlier, b.frame);
            Some((b.frame, fit.locate_sized(&b.observed, *heading, (mean, size_information), start)?))
        };
        self.track.boxes.iter().filter_map(one).collect()
    }
}

/// The fit of a frame among those in order of frames.
pub(super) fn fit_in_frame(fits: &[(usize, SingleView)], frame: usize) -> Option<&SingleView> {
    fits.binary_search_by_key(&frame, |(frame, _)| *frame)
        .ok()
        .and_then(|k| fits.get(k))
        .map(|(_, view)| view)
}
