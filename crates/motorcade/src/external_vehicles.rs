//! Vehicle poses from a file, in place of our own localisation.
//!
//! CSV with a header; columns are found by name: `frame`, `track_id`, `tx`, `ty`, `tz` (camera frame, metres; any point on
//! the vehicle's vertical axis) and `R00`, `R02` of a rotation about the camera's y axis that turns z into the vehicle's
//! forward direction. Other columns, ground truth among them, are not looked at.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_geometry::PinholeCamera;
use motorcade_perception::Detection;
use motorcade_vehicles::{ExternalTrack, ExternalView, GroundFrame, ObservedBox, Source, Track, TrackBox};
use nalgebra::{Matrix3, Point3, Vector3};
use serde::Deserialize;

use crate::error::{Error, Result};

/// A pose of a vehicle in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct ExternalVehiclePose {
    /// The input's own frame number.
    pub frame: u64,
    /// Identity.
    pub track_id: i64,
    /// Right of the camera \[m\].
    pub tx: f64,
    /// Below the camera \[m\].
    pub ty: f64,
    /// In front of the camera \[m\].
    pub tz: f64,
    /// Cosine of the heading about y.
    #[serde(rename = "R00")]
    pub r00: f64,
    /// Sine of the heading about y.
    #[serde(rename = "R02")]
    pub r02: f64,
}

/// Reads files of poses; several files are one list.
///
/// # Errors
/// A file that does not read, a missing column, a cell that is no number (file and line are named).
pub fn read_vehicle_poses(paths: &[std::path::PathBuf]) -> Result<Vec<ExternalVehiclePose>> {
    let mut all = Vec::new();
    for path in paths {
        all.extend(read_one(path)?);
    }
    Ok(all)
}

fn read_one(path: &Path) -> Result<Vec<ExternalVehiclePose>> {
    let problem = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        let text =
            format!("{}:{line}: expected columns frame, track_id, tx, ty, tz, R00, R02: {e}", path.display());
        Error::Input(text)
    };
    let mut reader = csv::Reader::from_path(path).map_err(problem)?;
    let rows: std::result::Result<Vec<ExternalVehiclePose>, csv::Error> = reader.deserialize().collect();
    let rows = rows.map_err(problem)?;
    let finite = |p: &ExternalVehiclePose| {
        [p.tx, p.ty, p.tz, p.r00, p.r02].iter().all(|v| v.is_finite()) && p.tz > 0.0
    };
    if let Some(index) = rows.iter().position(|p| !finite(p)) {
        let text = "expected finite numbers and tz in front of the camera";
        return Err(Error::Input(format!("{}:{}: {text}", path.display(), index + 2)));
    }
    Ok(rows)
}

/// Depth error of a single-view pose as a share of its distance: published front ends reach 5–8 % within 30 m. Most of it is common
/// to all frames of a vehicle, which the front end takes for larger or smaller than it is; the rest is a frame's own.
const COMMON_SHARE: f64 = 0.06;
const OWN_SHARE: f64 = 0.053;

/// Headings of such poses scatter by 5 to 10° from frame to frame.
const HEADING_SIGMA_RAD: f64 = 0.15;

/// Tracks and views from given poses. A detection with the same identity in the same frame becomes the track's box.
pub(crate) fn external_tracks(
    poses: &[ExternalVehiclePose],
    numbers: &[u64],
    grounds: &[GroundFrame],
    detections: &[Vec<Detection>],
    camera: &PinholeCamera,
) -> Vec<(Track, ExternalTrack)> {
    let rows: BTreeMap<u64, usize> = numbers.iter().enumerate().map(|(row, number)| (*number, row)).collect();
    let mut by_track: BTreeMap<i64, Vec<ExternalView>> = BTreeMap::new();
    for pose in poses {
        let Some(frame) = rows.get(&pose.frame) else { continue };
        by_track.entry(pose.track_id).or_default().push(view(pose, *frame, &grounds[*frame]));
    }
    let one = |(id, mut views): (i64, Vec<ExternalView>)| {
        views.sort_by_key(|v| v.frame);
        let mut boxes = Vec::new();
        for (frame, seen) in detections.iter().enumerate() {
            let all: Vec<_> = seen.iter().map(|d| d.bbox).collect();
            let within = views.first().is_some_and(|f| frame >= f.frame)
                && views.last().is_some_and(|l| frame <= l.frame);
            for d in seen.iter().filter(|d| within && d.external_id == Some(id)) {
                boxes.push(TrackBox { frame, seen: ObservedBox::new(d, camera, &all), score: d.score });
            }
        }
        let class =
            boxes.first().map_or(motorcade_perception::VehicleClass::Car, |b: &TrackBox| b.seen.class);
        (Track { id: usize::try_from(id).unwrap_or(0), class, boxes }, ExternalTrack { views, size: None })
    };
    by_track.into_iter().map(one).collect()
}

/// The pose brought down to the road along the road's normal, with its covariance.
fn view(pose: &ExternalVehiclePose, frame: usize, ground: &GroundFrame) -> ExternalView {
    let point = Vector3::new(pose.tx, pose.ty, pose.tz);
    let above = (point - ground.foot()).dot(&ground.up);
    let position = point - ground.up * above;
    let ray = position.normalize();
    let range = position.norm();
    let along = (OWN_SHARE * range).hypot(0.3).hypot(COMMON_SHARE * range);
    let across = (0.01 * range).hypot(0.1);
    let spread = ray * ray.transpose();
    let covariance = spread * along.powi(2) + (Matrix3::identity() - spread) * across.powi(2);
    let forward = Vector3::new(pose.r02, 0.0, pose.r00).normalize();
    ExternalView {
        frame,
        position_in_camera: Point3::from(position),
        forward_in_camera: forward,
        covariance,
        heading_sigma_rad: HEADING_SIGMA_RAD,
        by_size: None,
        scale_sigma: COMMON_SHARE,
        source: Source::External,
    }
}
