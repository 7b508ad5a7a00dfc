//! Errors of the vehicles' trajectories.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use motorcade_dataset::{Cam0, Label};
use motorcade_geometry::{Camera, Pose};
use nalgebra::{Point3, Vector3};

use crate::ego::AlignedTrajectories;
use crate::matching::{ByFrame, assign};
use crate::statistics::{mean, rms};

/// Labelled vehicles farther away than this are not evaluated \[m\].
const MAX_RANGE_M: f64 = 50.0;
/// Labelled boxes lower than this are not evaluated \[px\].
const MIN_HEIGHT_PX: f64 = 40.0;
/// Vehicles with fewer evaluated frames are not reported.
const MIN_FRAMES: usize = 10;

/// Errors of one labelled vehicle over its evaluated frames: unoccluded, untruncated, box ≥ 40 px high, in range.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct VehicleReport {
    /// Identity in the labels.
    pub label: i64,
    /// Evaluated frames.
    pub frames: usize,
    /// Share of them with an estimate whose box overlaps by IoU ≥ 0.5.
    pub coverage: f64,
    /// Changes of the estimate's identity.
    pub id_switches: usize,
    /// Length of its true path in the world over the frames with an estimate \[m\].
    pub driven_m: f64,
    /// Nearest and farthest distance along the optical axis \[m\].
    pub depth_m: Option<[f64; 2]>,
    /// RMS of the bottom centre in the world, first camera poses identified \[m\].
    pub ate_origin_m: Option<f64>,
    /// The same after the SE(3) alignment of the camera's trajectory \[m\].
    pub ate_ego_se3_m: Option<f64>,
    /// RMS relative to the camera \[m\].
    pub error_in_camera_m: Option<f64>,
    /// Mean heading error \[deg\].
    pub heading_error_deg: Option<f64>,
}

/// Means over the vehicles with an estimate; coverage over all, weighted by frames.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct VehicleMeans {
    /// Reported vehicles.
    pub vehicles: usize,
    /// Covered frames / evaluated frames.
    pub coverage: f64,
    /// Mean of the vehicles' ATE, first camera poses identified \[m\].
    pub ate_origin_m: f64,
    /// Mean of the vehicles' ATE after the SE(3) alignment of the camera's trajectory \[m\].
    pub ate_ego_se3_m: f64,
    /// Mean of the vehicles' errors relative to the camera \[m\].
    pub error_in_camera_m: f64,
    /// Mean of the vehicles' mean heading errors \[deg\].
    pub heading_error_deg: f64,
    /// Sum of identity switches.
    pub id_switches: usize,
}

/// Ground truth and estimates of a drive.
pub(crate) struct Vehicles<'a> {
    /// Labels of camera 2: positions and sizes.
    pub labels: &'a ByFrame,
    /// The same labels with boxes in the processed camera.
    pub boxes: &'a ByFrame,
    pub estimates: &'a ByFrame,
    pub camera_from_cam0: Pose<Camera, Cam0>,
    /// Frame number of row 0.
    pub first: u64,
}

/// One matched frame of one vehicle.
struct Sample {
    id: i64,
    truth_in_world: Point3<f64>,
    in_world: Vector3<f64>,
    in_aligned_world: Vector3<f64>,
    in_camera: Vector3<f64>,
    heading_rad: f64,
    depth_m: f64,
}

#[derive(Default)]
struct Track {
    frames: usize,
    samples: Vec<Sample>,
}

impl Vehicles<'_> {
    pub(crate) fn evaluate(&self, ego: &AlignedTrajectories) -> Vec<VehicleReport> {
        // Results may number frames by the run's rows.
        let numbered_by_row = self.estimates.keys().next().is_some_and(|frame| *frame < self.first);
        let shift = if numbered_by_row { self.first } else { 0 };
        let mut tracks: BTreeMap<i64, Track> = BTreeMap::new();
        let of = |frames: &'_ ByFrame, frame: u64| frames.get(&frame).cloned().unwrap_or_default();
        for row in 0..ego.truth.len() {
            let frame = self.first + row as u64;
            let (labels, boxes) = (of(self.labels, frame), of(self.boxes, frame));
            let estimates = of(self.estimates, frame - shift);
            for (shown, assigned) in boxes.iter().zip(assign(&boxes, &estimates)) {
                let label = labels.iter().find(|label| label.track == shown.track).unwrap_or(shown);
                if !is_evaluated(label, shown) {
                    continue;
                }
                let track = tracks.entry(shown.track).or_default();
                track.frames += 1;
                if let Some(j) = assigned {
                    track.samples.push(self.sample(ego, row, label, &estimates[j]));
                }
            }
        }
        let long = tracks.into_iter().filter(|(_, track)| track.frames >= MIN_FRAMES);
        long.map(|(label, track)| track.report(label)).collect()
    }

    fn sample(&self, ego: &AlignedTrajectories, row: usize, label: &Label, estimate: &Label) -> Sample {
        let (estimated, labelled) = (Point3::from(estimate.location_m), Point3::from(label.location_m));
        let estimate_in_world = (ego.estimate[row] * self.camera_from_cam0).transform_point(&estimated);
        let truth_in_world = (ego.truth[row] * self.camera_from_cam0).transform_point(&labelled);
        let turn = (estimate.ry_rad - label.ry_rad + PI).rem_euclid(2.0 * PI) - PI;
        Sample {
            id: estimate.track,
            truth_in_world,
            in_world: estimate_in_world - truth_in_world,
            in_aligned_world: ego.se3.transform_point(&estimate_in_world) - truth_in_world,
            in_camera: estimated - labelled,
            heading_rad: turn.abs(),
            depth_m: label.location_m[2],
        }
    }
}

fn is_evaluated(label: &Label, shown: &Label) -> bool {
    label.occluded <= 0.0
        && label.truncated <= 0.0
        && shown.bbox_px[3] - shown.bbox_px[1] >= MIN_HEIGHT_PX
        && label.location_m[2] <= MAX_RANGE_M
}

impl Track {
    fn report(&self, label: i64) -> VehicleReport {
        let samples = &self.samples;
        let depths = samples.iter().map(|sample| sample.depth_m);
        let nearest = depths.clone().min_by(f64::total_cmp);
        let farthest = depths.max_by(f64::total_cmp);
        VehicleReport {
            label,
            frames: self.frames,
            coverage: samples.len() as f64 / self.frames as f64,
            id_switches: samples.windows(2).filter(|pair| pair[0].id != pair[1].id).count(),
            driven_m: samples.windows(2).map(|w| (w[1].truth_in_world - w[0].truth_in_world).norm()).sum(),
            depth_m: nearest.zip(farthest).map(|(near, far)| [near, far]),
            ate_origin_m: rms(samples.iter().map(|sample| sample.in_world)),
            ate_ego_se3_m: rms(samples.iter().map(|sample| sample.in_aligned_world)),
            error_in_camera_m: rms(samples.iter().map(|sample| sample.in_camera)),
            heading_error_deg: mean(samples.iter().map(|sample| sample.heading_rad.to_degrees())),
        }
    }
}

/// Means of reports; `None` when no vehicle has an estimate.
pub(crate) fn means(reports: &[VehicleReport]) -> Option<VehicleMeans> {
    let of = |value: fn(&VehicleReport) -> Option<f64>| mean(reports.iter().filter_map(value));
    let frames: usize = reports.iter().map(|report| report.frames).sum();
    let covered: f64 = reports.iter().map(|report| report.coverage * report.frames as f64).sum();
    Some(VehicleMeans {
        vehicles: reports.len(),
        coverage: covered / frames as f64,
        ate_origin_m: of(|report| report.ate_origin_m)?,
        ate_ego_se3_m: of(|report| report.ate_ego_se3_m)?,
        error_in_camera_m: of(|report| report.error_in_camera_m)?,
        heading_error_deg: of(|report| report.heading_error_deg)?,
        id_switches: reports.iter().map(|report| report.id_switches).sum(),
    })
}
