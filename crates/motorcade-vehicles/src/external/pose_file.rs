//! Tracks from the vehicle poses of a file.

use std::collections::BTreeMap;

use motorcade_dataset::ExternalVehiclePose;
use motorcade_geometry::PinholeCamera;
use motorcade_perception::{Detection, VehicleClass};
use nalgebra::{Matrix3, Point3, Vector3};

use super::{ExternalTrack, ExternalView};
use crate::ground::GroundFrame;
use crate::observed_box::ObservedBox;
use crate::options::{ExternalViewOptions, VehicleOptions};
use crate::track::{Track, TrackBox};
use crate::trajectory::Source;

/// Tracks with their views; `numbers` are the input's frame numbers by row. A detection with the same identity within the
/// track's frames becomes a box of the track.
pub fn external_tracks(
    poses: &[ExternalVehiclePose],
    numbers: &[u64],
    grounds: &[GroundFrame],
    detections: &[Vec<Detection>],
    camera: &PinholeCamera,
    options: &VehicleOptions,
) -> Vec<(Track, ExternalTrack)> {
    let advanced = &options.advanced;
    let rows: BTreeMap<u64, usize> = numbers.iter().enumerate().map(|(row, number)| (*number, row)).collect();
    let mut by_track: BTreeMap<i64, Vec<ExternalView>> = BTreeMap::new();
    for pose in poses {
        let Some(frame) = rows.get(&pose.frame) else { continue };
        let view = view(pose, *frame, &grounds[*frame], &advanced.external);
        by_track.entry(pose.track_id).or_default().push(view);
    }
    let one = |(id, mut views): (i64, Vec<ExternalView>)| {
        views.sort_by_key(|v| v.frame);
        let mut boxes = Vec::new();
        let span = views.first().map_or(0, |v| v.frame)..=views.last().map_or(0, |v| v.frame);
        for (frame, found) in span.filter_map(|frame| Some((frame, detections.get(frame)?))) {
            let all: Vec<_> = found.iter().map(|d| d.bbox).collect();
            for d in found.iter().filter(|d| d.external_id == Some(id)) {
                let observed = ObservedBox::new(d, camera, &all, &advanced.box_fit);
                boxes.push(TrackBox { frame, observed, score: d.score });
            }
        }
        let class = boxes.first().map_or(VehicleClass::Car, |b: &TrackBox| b.observed.class);
        (Track::new(usize::try_from(id).unwrap_or(0), class, boxes), ExternalTrack { views, size: None })
    };
    by_track.into_iter().map(one).collect()
}

/// The pose projected onto the road along its normal, with its covariance.
fn view(
    pose: &ExternalVehiclePose,
    frame: usize,
    ground: &GroundFrame,
    options: &ExternalViewOptions,
) -> ExternalView {
    let point = Vector3::new(pose.tx, pose.ty, pose.tz);
    let above = (point - ground.foot()).dot(&ground.up);
    let position = point - ground.up * above;
    let ray = position.normalize();
    let range = position.norm();
    let own = (options.own_depth_share * range).hypot(options.depth_sigma_m);
    let along = own.hypot(options.common_depth_share * range);
    let across = (options.lateral_share * range).hypot(options.lateral_sigma_m);
    let spread = ray * ray.transpose();
    let covariance = spread * along.powi(2) + (Matrix3::identity() - spread) * across.powi(2);
    ExternalView {
        frame,
        position_in_camera: Point3::from(position),
        forward_in_camera: Vector3::new(pose.r02, 0.0, pose.r00).normalize(),
        covariance,
        heading_sigma_rad: options.heading_sigma_rad,
        size_dependence: None,
        scale_sigma: options.common_depth_share,
        source: Source::External,
    }
}
