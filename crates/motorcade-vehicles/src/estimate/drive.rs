//! A drive as the vehicles of a track are estimated in it.

use motorcade_geometry::{BoundingBox, PinholeCamera};

use super::consistency::overlaps;
use super::estimate_track;
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::observed_box::ObservedBox;
use crate::options::{HypothesisOptions, VehicleOptions};
use crate::time::independent_views;
use crate::track::{Track, TrackBox};
use crate::trajectory::VehicleTrajectory;

/// The inputs that the estimates of all tracks of a drive share.
pub(super) struct Drive<'a, V> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) grounds: &'a [GroundFrame],
    pub(super) views: &'a V,
    pub(super) options: &'a VehicleOptions,
}

impl<V: Fn(&Track) -> ExternalTrack> Drive<'_, V> {
    pub(super) fn hypothesis(&self) -> &HypothesisOptions {
        &self.options.advanced.hypothesis
    }

    /// True when a vehicle counts as moving.
    pub(super) fn moves(&self, vehicle: &VehicleTrajectory) -> bool {
        vehicle.p_moving > self.options.advanced.kinematic_state.moving_from
    }

    /// The estimate of a track as one vehicle.
    pub(super) fn estimate(&self, track: &Track) -> Option<VehicleTrajectory> {
        estimate_track(self.camera, self.grounds, track, &(self.views)(track), self.options)
    }

    /// For each box of a track how much a vehicle overlaps it.
    pub(super) fn overlaps(
        &self,
        overlap: fn(&BoundingBox, &ObservedBox) -> f64,
        track: &Track,
        vehicle: &VehicleTrajectory,
    ) -> Vec<f64> {
        overlaps(overlap, self.camera, self.grounds, track, vehicle)
    }

    /// For each box of a track whether a vehicle overlaps it by `least_iou`.
    pub(super) fn explained(
        &self,
        overlap: fn(&BoundingBox, &ObservedBox) -> f64,
        track: &Track,
        vehicle: &VehicleTrajectory,
        least_iou: f64,
    ) -> Vec<bool> {
        self.overlaps(overlap, track, vehicle).into_iter().map(|iou| iou >= least_iou).collect()
    }

    /// True when boxes are enough for a vehicle.
    pub(super) fn enough(&self, boxes: &[TrackBox]) -> bool {
        let time_s =
            |b: Option<&TrackBox>| b.and_then(|b| self.grounds.get(b.frame)).map_or(0.0, |g| g.time_s);
        let duration_s = time_s(boxes.last()) - time_s(boxes.first());
        let correlation_time_s = self.options.advanced.correlation_time_s;
        let independent = independent_views(boxes.len(), duration_s, correlation_time_s, f64::MAX);
        independent >= self.hypothesis().least_consistent_boxes
    }
}
