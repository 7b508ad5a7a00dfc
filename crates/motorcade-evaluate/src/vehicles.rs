//! Errors of the vehicles' trajectories.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use motorcade_dataset::{Cam0, Label};
use motorcade_geometry::robust::{median_midpoint, quantile};
use motorcade_geometry::{Camera, Pose, Vehicle, World};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::deviations::VehicleDeviations;
use crate::ego::AlignedTrajectories;
use crate::matching::{ByFrame, assign, in_frame};
use crate::statistics::{mean, rms};
use crate::vehicle_nees::{VehicleConsistency, VehicleNees};

/// Labelled vehicles farther away than this are not evaluated \[m\].
const MAX_RANGE_M: f64 = 50.0;
/// Labelled boxes lower than this are not evaluated \[px\].
const MIN_HEIGHT_PX: f64 = 40.0;
/// Errors of depth are those of vehicles up to this distance \[m\].
const DEPTH_RANGE_M: f64 = 40.0;
/// Labelled vehicles that get less far from their first place stand: labels wander \[m\].
const MOVES_FAR_M: f64 = 5.0;
/// Way over which the error of a motion is given per length \[m\].
const MOTION_PATH_M: f64 = 1.0;
/// Headings that err by more are the wrong way round \[rad\].
const REVERSED_RAD: f64 = FRAC_PI_2;
/// Vehicles that are evaluated for a shorter time are not reported \[s\]: ten frames of KITTI.
const MIN_TIME_S: f64 = 1.0;

/// Errors of one labelled vehicle over its evaluated frames: unoccluded, untruncated, box ≥ 40 px high, in range.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct VehicleReport {
    /// Identity in the labels.
    pub label: i64,
    /// Evaluated frames.
    pub frames: usize,
    /// Share of them with an estimate whose box overlaps by IoU ≥ 0.5.
    pub coverage: f64,
    /// Identities of its estimates, in the order in which they appear. Not part of the JSON.
    #[serde(skip)]
    pub estimates: Vec<i64>,
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
    /// RMS of the error of its motion from frame to frame, in its own frame, translation \[m\].
    pub motion_error_m: Option<f64>,
    /// The same of the rotation \[deg\].
    pub motion_error_deg: Option<f64>,
    /// RMS of the error of its motion over a metre of its true path, translation \[m/m\]; none for a vehicle that stands.
    pub rpe_m_per_m: Option<f64>,
    /// The same of the rotation \[deg/m\].
    pub rpe_deg_per_m: Option<f64>,
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
    /// Median error of the heading over all evaluated frames of these vehicles \[deg\]. Not part of the JSON.
    #[serde(skip)]
    pub heading_error_deg_median: Option<f64>,
    /// Share of these frames in which the heading errs by more than a right angle. Not part of the JSON.
    #[serde(skip)]
    pub reversed_share: f64,
    /// Sum of identity switches.
    pub id_switches: usize,
    /// Median error of the depth over all evaluated frames of these vehicles within 40 m \[%\].
    pub depth_error_pct_median: Option<f64>,
    /// 90th percentile of it \[%\].
    pub depth_error_pct_p90: Option<f64>,
    /// Mean of the vehicles' errors of motion from frame to frame, translation \[m\].
    pub motion_error_m: Option<f64>,
    /// The same of the rotation \[deg\].
    pub motion_error_deg: Option<f64>,
    /// Mean of the moving vehicles' errors of motion over a metre of their path, translation \[m/m\].
    pub rpe_m_per_m: Option<f64>,
    /// The same of the rotation \[deg/m\].
    pub rpe_deg_per_m: Option<f64>,
}

/// Ground truth and estimates of a drive.
pub(crate) struct Vehicles<'a> {
    /// Labels of camera 2: positions and sizes.
    pub labels: &'a ByFrame,
    /// The same labels with boxes in the processed camera.
    pub boxes: &'a ByFrame,
    pub estimates: &'a ByFrame,
    /// Deviations of the estimates by their frame and identity; none when the run gives none.
    pub deviations: Option<&'a BTreeMap<(u64, i64), VehicleDeviations>>,
    pub camera_from_cam0: Pose<Camera, Cam0>,
    /// Frame number of row 0.
    pub first: u64,
    /// Frames per second.
    pub fps: f64,
}

/// Errors of the labelled vehicles.
pub(crate) struct VehicleErrors {
    pub(crate) reports: Vec<VehicleReport>,
    pub(crate) means: Option<VehicleMeans>,
    /// None when the run gives no deviations.
    pub(crate) consistency: Option<VehicleConsistency>,
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
    row: usize,
    nees: Option<VehicleNees>,
    /// True and estimated pose, each in its own world.
    world_from_vehicle: [Pose<World, Vehicle>; 2],
}

#[derive(Default)]
struct Track {
    frames: usize,
    samples: Vec<Sample>,
}

impl Vehicles<'_> {
    pub(crate) fn evaluate(&self, ego: &AlignedTrajectories) -> VehicleErrors {
        let mut tracks: BTreeMap<i64, Track> = BTreeMap::new();
        for row in 0..ego.truth.len() {
            let frame = self.first + row as u64;
            let (labels, boxes) = (in_frame(self.labels, frame), in_frame(self.boxes, frame));
            let estimates = in_frame(self.estimates, frame);
            for (shown, assigned) in boxes.iter().zip(assign(boxes, estimates)) {
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
        let least_frames = (MIN_TIME_S * self.fps).round().max(2.0) as usize;
        let long = tracks.into_iter().filter(|(_, track)| track.frames >= least_frames);
        let long: Vec<(i64, Track)> = long.collect();
        let reports: Vec<VehicleReport> = long.iter().map(|(label, track)| track.report(*label)).collect();
        let samples = || long.iter().flat_map(|(_, track)| &track.samples);
        let means = means(&reports, &samples().collect::<Vec<_>>());
        let nees: Vec<VehicleNees> = samples().filter_map(|sample| sample.nees).collect();
        VehicleErrors { reports, means, consistency: VehicleConsistency::of(&nees) }
    }

    fn sample(&self, ego: &AlignedTrajectories, row: usize, label: &Label, estimate: &Label) -> Sample {
        let (estimated, labelled) = (Point3::from(estimate.location_m), Point3::from(label.location_m));
        let estimate_in_world = (ego.estimate[row] * self.camera_from_cam0).transform_point(&estimated);
        let truth_in_world = (ego.truth[row] * self.camera_from_cam0).transform_point(&labelled);
        let turn = (estimate.ry_rad - label.ry_rad + PI).rem_euclid(2.0 * PI) - PI;
        let in_camera = estimated - labelled;
        let deviations = self.deviations.and_then(|all| all.get(&(estimate.frame, estimate.track)));
        Sample {
            id: estimate.track,
            nees: deviations.and_then(|d| VehicleNees::new(estimate, &in_camera, turn, d)),
            truth_in_world,
            in_world: estimate_in_world - truth_in_world,
            in_aligned_world: ego.se3.transform_point(&estimate_in_world) - truth_in_world,
            in_camera,
            heading_rad: turn.abs(),
            depth_m: label.location_m[2],
            row,
            world_from_vehicle: [
                ego.truth[row] * self.camera_from_cam0 * pose(label),
                ego.estimate[row] * self.camera_from_cam0 * pose(estimate),
            ],
        }
    }
}

fn is_evaluated(label: &Label, shown: &Label) -> bool {
    label.occluded <= 0.0
        && label.truncated <= 0.0
        && shown.bbox.height() >= MIN_HEIGHT_PX
        && label.location_m[2] <= MAX_RANGE_M
}

/// Pose of KITTI's object: x along its length, y down, origin at the bottom-face centre.
fn pose(label: &Label) -> Pose<Cam0, Vehicle> {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), label.ry_rad);
    Pose::from_parts(rotation, Vector3::from(label.location_m))
}

impl Sample {
    /// Error of the depth \[%\] of a vehicle that is near enough.
    fn depth_error_pct(&self) -> Option<f64> {
        let near = self.depth_m > 0.0 && self.depth_m <= DEPTH_RANGE_M;
        near.then(|| 100.0 * self.in_camera.z.abs() / self.depth_m)
    }

    /// Error of the motion to a later sample, in the vehicle's frame.
    fn motion_error(&self, later: &Self) -> Pose<Vehicle, Vehicle> {
        let motion = |k: usize| self.world_from_vehicle[k].inverse() * later.world_from_vehicle[k];
        motion(1).inverse() * motion(0)
    }

    fn is_followed_by(&self, next: &Self) -> bool {
        next.row == self.row + 1 && next.id == self.id
    }
}

impl Track {
    fn report(&self, label: i64) -> VehicleReport {
        let samples = &self.samples;
        let depths = samples.iter().map(|sample| sample.depth_m);
        let nearest = depths.clone().min_by(f64::total_cmp);
        let farthest = depths.max_by(f64::total_cmp);
        let over_metres = self.motion_errors_per_m();
        let motions: Vec<_> = samples
            .windows(2)
            .filter(|pair| pair[0].is_followed_by(&pair[1]))
            .map(|pair| pair[0].motion_error(&pair[1]))
            .collect();
        VehicleReport {
            label,
            frames: self.frames,
            coverage: samples.len() as f64 / self.frames as f64,
            estimates: identities(samples),
            id_switches: samples.windows(2).filter(|pair| pair[0].id != pair[1].id).count(),
            driven_m: samples.windows(2).map(|w| (w[1].truth_in_world - w[0].truth_in_world).norm()).sum(),
            depth_m: nearest.zip(farthest).map(|(near, far)| [near, far]),
            ate_origin_m: rms(samples.iter().map(|sample| sample.in_world)),
            ate_ego_se3_m: rms(samples.iter().map(|sample| sample.in_aligned_world)),
            error_in_camera_m: rms(samples.iter().map(|sample| sample.in_camera)),
            heading_error_deg: mean(samples.iter().map(|sample| sample.heading_rad.to_degrees())),
            motion_error_m: rms(motions.iter().map(Pose::translation)),
            motion_error_deg: rms(motions.iter().map(|m| m.rotation().scaled_axis())).map(f64::to_degrees),
            rpe_m_per_m: rms(over_metres.iter().map(|[shift, _]| *shift)),
            rpe_deg_per_m: rms(over_metres.iter().map(|[_, turn]| *turn)).map(f64::to_degrees),
        }
    }

    /// Errors of the motion between samples that are a metre and more of true path apart, per metre: translation and rotation.
    fn motion_errors_per_m(&self) -> Vec<[Vector3<f64>; 2]> {
        let Some(mut from) = self.samples.first().filter(|_| self.moves()) else { return Vec::new() };
        let (mut path_m, mut errors) = (0.0, Vec::new());
        for pair in self.samples.windows(2) {
            path_m += (pair[1].truth_in_world - pair[0].truth_in_world).norm();
            if path_m >= MOTION_PATH_M {
                let error = from.motion_error(&pair[1]);
                errors.push([error.translation(), error.rotation().scaled_axis()].map(|e| e / path_m));
                (from, path_m) = (&pair[1], 0.0);
            }
        }
        errors
    }

    fn moves(&self) -> bool {
        let far = |sample: &Sample| (sample.truth_in_world - self.samples[0].truth_in_world).norm();
        self.samples.iter().map(far).fold(0.0, f64::max) >= MOVES_FAR_M
    }
}

/// Identities of the estimates of a vehicle, each once.
fn identities(samples: &[Sample]) -> Vec<i64> {
    let mut known = Vec::new();
    for sample in samples {
        if !known.contains(&sample.id) {
            known.push(sample.id);
        }
    }
    known
}

/// Means of reports, and of all their frames; `None` when no vehicle has an estimate.
fn means(reports: &[VehicleReport], samples: &[&Sample]) -> Option<VehicleMeans> {
    let mut depths: Vec<f64> = samples.iter().filter_map(|sample| sample.depth_error_pct()).collect();
    let mut headings: Vec<f64> = samples.iter().map(|sample| sample.heading_rad.to_degrees()).collect();
    let reversed = samples.iter().filter(|sample| sample.heading_rad > REVERSED_RAD).count();
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
        heading_error_deg_median: median_midpoint(&mut headings),
        reversed_share: reversed as f64 / samples.len().max(1) as f64,
        id_switches: reports.iter().map(|report| report.id_switches).sum(),
        depth_error_pct_median: median_midpoint(&mut depths),
        depth_error_pct_p90: quantile(&mut depths, 0.9),
        motion_error_m: of(|report| report.motion_error_m),
        motion_error_deg: of(|report| report.motion_error_deg),
        rpe_m_per_m: of(|report| report.rpe_m_per_m),
        rpe_deg_per_m: of(|report| report.rpe_deg_per_m),
    })
}
