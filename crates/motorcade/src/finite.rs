//! Estimates that are no numbers: none reaches a file.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{EgoFrame, FrameStatus};
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::result::RunResult;

/// Variance that stands for an unknown one \[m², rad²\].
const UNKNOWN_VARIANCE: f64 = 1e6;

/// Replaces camera poses that are not finite by the one before, their covariances by a large one, removes vehicle states that are not finite, and
/// replaces covariances of vehicles that are none. Vehicles without a state or a size go. Says what it did.
pub(crate) fn keep_finite(result: &mut RunResult) -> Vec<String> {
    let mut out = Vec::new();
    let mut before = None;
    for (ego, info) in result.ego.frames.iter_mut().zip(&result.frames) {
        if repair(ego, before) {
            out.push(format!(
                "frame {}: the estimate is not finite; the pose of the frame before stands for it",
                info.number
            ));
        }
        before = Some(ego.world_from_camera);
    }
    result.speeds_mps.iter_mut().flatten().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    for vehicle in &mut result.vehicles {
        let all = vehicle.states.len();
        vehicle.states.retain(is_finite);
        let lost = all - vehicle.states.len();
        if lost > 0 {
            out.push(format!("vehicle {}: {lost} of {all} states are not finite and left out", vehicle.id));
        }
        let unknown = vehicle.states.iter_mut().filter_map(widen).count();
        if unknown > 0 {
            let (id, states) = (vehicle.id, vehicle.states.len());
            out.push(format!(
                "vehicle {id}: the uncertainty of {unknown} of {states} states is of no use; that of each frame alone stands, 1000 m without a measurement"
            ));
        }
        if !vehicle.size_covariance.iter().all(|v| v.is_finite()) {
            vehicle.size_covariance = Matrix3::identity() * UNKNOWN_VARIANCE;
            out.push(format!(
                "vehicle {}: the uncertainty of its size is of no use; 1000 m stand for it",
                vehicle.id
            ));
        }
        if !is_whole(vehicle) {
            out.push(format!("vehicle {}: its size or P(moving) is not finite; it is left out", vehicle.id));
        }
    }
    result.vehicles.retain(|v| !v.states.is_empty() && is_whole(v));
    out
}

fn is_whole(vehicle: &VehicleTrajectory) -> bool {
    vehicle.p_moving.is_finite() && vehicle.size.to_vector().iter().all(|v| v.is_finite())
}

/// True when the frame had to be changed.
fn repair(ego: &mut EgoFrame, before: Option<Pose<World, Camera>>) -> bool {
    let unknown = Matrix6::identity() * UNKNOWN_VARIANCE;
    let mut finite = ego.world_from_camera.is_finite();
    if !finite {
        ego.world_from_camera = before.unwrap_or_default();
        ego.status = FrameStatus::Bridged;
        ego.covariance = unknown;
    }
    if !ego.covariance.iter().all(|v| v.is_finite()) {
        (ego.covariance, finite) = (unknown, false);
    }
    for number in [&mut ego.scale, &mut ego.scale_sigma, &mut ego.scale_bias_sigma] {
        if !number.is_finite() {
            (*number, finite) = (1.0, false);
        }
    }
    if !ego.road_normal.iter().all(|v| v.is_finite()) {
        (ego.road_normal, finite) = (-Vector3::y(), false);
    }
    !finite
}

/// Replaces a covariance that is none, or none of use (variances of zero and below, or beyond the unknown one), by that of the frame's own measurement,
/// or by an unknown one.
fn widen(state: &mut VehicleState) -> Option<()> {
    let usable = |c: &Matrix6<f64>| c.diagonal().iter().all(|v| *v > 0.0 && *v <= UNKNOWN_VARIANCE);
    let own = state.measurement.map(|m| m.covariance).filter(usable);
    (!usable(&state.covariance))
        .then(|| state.covariance = own.unwrap_or(Matrix6::identity() * UNKNOWN_VARIANCE))
}

fn is_finite(state: &VehicleState) -> bool {
    let bbox = state.bbox.map_or([0.0; 4], |b| b.to_array());
    let numbers = [state.speed_mps, state.speed_sigma_mps, state.yaw_rate_radps, state.score];
    let all = state.covariance.iter().chain(&numbers).chain(&bbox);
    state.world_from_vehicle.is_finite() && all.copied().all(f64::is_finite)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::output::{self, OutputDirectory, RUN_RECORD};
    use crate::test_results::{context, result, vehicle};
    use std::path::{Path, PathBuf};

    pub(crate) fn frame() -> EgoFrame {
        EgoFrame {
            world_from_camera: Pose::from_parts(
                nalgebra::UnitQuaternion::identity(),
                Vector3::new(1.0, 2.0, 3.0),
            ),
            status: FrameStatus::Tracked,
            step_measured: true,
            step_covariance: Matrix6::identity(),
            covariance: Matrix6::identity(),
            scale: 1.5,
            scale_sigma: 0.1,
            scale_sigma_alone: 0.1,
            scale_correlation: 0.0,
            scale_bias_sigma: 0.0,
            scale_measured: true,
            road_normal: -Vector3::y(),
            road_tilt_covariance: Matrix3::identity(),
            inliers: 100,
        }
    }

    #[test]
    fn frames_that_are_no_numbers_take_the_pose_before() {
        let good = frame();
        let mut same = good.clone();
        assert!(!repair(&mut same, None) && same.scale == 1.5 && same.covariance == good.covariance);
        let lost = Pose::from_parts(good.world_from_camera.rotation(), Vector3::new(f64::NAN, 0.0, 0.0));
        let mut broken = EgoFrame { world_from_camera: lost, scale_sigma: f64::INFINITY, ..frame() };
        assert!(repair(&mut broken, Some(good.world_from_camera)));
        assert_eq!(broken.world_from_camera.translation(), good.world_from_camera.translation());
        assert_eq!((broken.status, broken.scale_sigma), (FrameStatus::Bridged, 1.0));
        let mut unsure = frame();
        unsure.covariance[(3, 3)] = f64::NAN;
        assert!(repair(&mut unsure, None) && unsure.covariance[(3, 3)] == UNKNOWN_VARIANCE);
    }

    /// A state with this variance of everything.
    pub(crate) fn state(variance: f64) -> VehicleState {
        VehicleState {
            frame: 0,
            world_from_vehicle: Pose::identity(),
            covariance: Matrix6::identity() * variance,
            bbox: None,
            score: 1.0,
            speed_mps: 0.0,
            speed_sigma_mps: 1.0,
            yaw_rate_radps: 0.0,
            source: motorcade_vehicles::Source::Box,
            measurement: None,
            observations: Vec::new(),
            heading_variance: 0.0,
            rival: None,
        }
    }

    #[test]
    fn covariances_of_no_use_are_unknown() {
        for lost in [0.0, -1e-3, 1e36] {
            let mut state = state(lost);
            assert!(widen(&mut state).is_some() && state.covariance[(3, 3)] == UNKNOWN_VARIANCE, "{lost}");
        }
        assert!(widen(&mut state(0.04)).is_none());
    }

    fn holds_none(text: &str) -> bool {
        let is_none = |word: &str| matches!(word.to_ascii_lowercase().as_str(), "nan" | "inf" | "infinity");
        text.split(|c: char| !c.is_alphanumeric()).any(is_none)
    }

    /// Files below a folder, and of them those that hold a number that is none.
    fn scanned(folder: &Path) -> (usize, Vec<PathBuf>) {
        let (mut files, mut spoilt) = (0, Vec::new());
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                let (more, others) = scanned(&path);
                files += more;
                spoilt.extend(others);
            } else {
                files += 1;
                spoilt.extend(holds_none(&std::fs::read_to_string(&path).unwrap()).then_some(path));
            }
        }
        (files, spoilt)
    }

    fn written(result: &RunResult) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let directory = OutputDirectory::open(folder.path(), RUN_RECORD, false).unwrap();
        output::write_run(&directory, result, &context(), &[]).unwrap();
        folder
    }

    /// Four frames and seven vehicles, each with another number that is none.
    fn broken() -> RunResult {
        let moved = |change: fn(&mut VehicleState)| {
            let mut moved = state(0.04);
            change(&mut moved);
            vec![state(0.04), moved]
        };
        let mut lost_size = vehicle(5, vec![state(0.04)]);
        lost_size.size.length_m = f64::NAN;
        let mut unsure_size = vehicle(6, vec![state(0.04)]);
        unsure_size.size_covariance[(1, 1)] = f64::NAN;
        let mut undecided = vehicle(7, vec![state(0.04)]);
        undecided.p_moving = f64::NAN;
        let far = |s: &mut VehicleState| {
            s.world_from_vehicle =
                Pose::from_parts(s.world_from_vehicle.rotation(), Vector3::repeat(f64::NAN));
        };
        let vehicles = vec![
            vehicle(1, moved(|s| s.speed_mps = f64::NAN)),
            vehicle(2, moved(far)),
            vehicle(3, moved(|s| s.covariance[(4, 4)] = f64::NAN)),
            vehicle(4, moved(|s| s.speed_sigma_mps = f64::INFINITY).split_off(1)),
            lost_size,
            unsure_size,
            undecided,
        ];
        let mut result = result(4, vehicles);
        result.speeds_mps = Some(vec![0.0, 10.0, f64::NAN, 10.0]);
        let ego = &mut result.ego.frames;
        ego[1].world_from_camera =
            Pose::from_parts(ego[1].world_from_camera.rotation(), Vector3::repeat(f64::NAN));
        ego[2].covariance[(5, 5)] = f64::NAN;
        (ego[3].scale, ego[3].scale_sigma) = (f64::NAN, f64::INFINITY);
        ego[3].road_normal = Vector3::repeat(f64::NAN);
        result
    }

    #[test]
    fn no_file_holds_a_number_that_is_none() {
        let mut result = broken();
        for table in [output::frames_csv(&result), output::tracks_csv(&result)] {
            assert!(holds_none(&String::from_utf8(table).unwrap()), "without the repair there are some");
        }
        let said = keep_finite(&mut result).join("\n");
        let folder = written(&result);
        let (files, spoilt) = scanned(folder.path());
        assert!(files >= 12 && spoilt.is_empty(), "{files} files, {spoilt:?}\n{said}");
        // JSON has no NaN: it would be written as null.
        let record: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join(RUN_RECORD)).unwrap()).unwrap();
        assert!(record["length_m"].is_number() && record["camera_height_m"].is_number(), "{record}");
        let ids: Vec<usize> = result.vehicles.iter().map(|v| v.id).collect();
        assert_eq!(ids, [1, 2, 3, 6], "without a state, a size or P(moving) a vehicle goes");
        assert!(result.vehicles[..3].iter().all(|v| v.states.len() == 1));
        assert_eq!(result.vehicles[3].size_sigma().width_m, 1000.0);
        assert_eq!(result.speeds_mps, Some(vec![0.0, 10.0, 0.0, 10.0]));
        for named in [
            "frame 1",
            "frame 2",
            "frame 3",
            "vehicle 1",
            "vehicle 2",
            "vehicle 3",
            "vehicle 4",
            "vehicle 5",
            "vehicle 6",
            "vehicle 7",
        ] {
            assert!(said.contains(&format!("{named}:")), "{named} is not named:\n{said}");
        }
    }
}
