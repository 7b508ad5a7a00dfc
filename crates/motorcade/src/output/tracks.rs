//! `vehicles/<id>.tum`, `tracks.csv`, `tracks.kitti.txt`.

use std::f64::consts::SQRT_2;
use std::io::{self, Write};
use std::path::Path;

use motorcade_dataset::{Cam0, Label, write_tum};
use motorcade_geometry::{Camera, Pose};
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{Source, VehicleState, VehicleTrajectory, box_in_picture};
use nalgebra::{Point3, Vector3};

use super::track_table::{TrackRow, TrackTable, sigma_from_camera};
use super::{RunContext, file};
use crate::error::Result;
use crate::result::RunResult;

pub(super) fn write(folder: &Path, result: &RunResult, context: &RunContext) -> Result<()> {
    for vehicle in &result.vehicles {
        let rows = vehicle.states.iter().map(|s| (result.frames[s.frame].timestamp_ns, s.world_from_vehicle));
        file(&folder.join(format!("vehicles/{}.tum", vehicle.id)), |out| write_tum(out, rows))?;
    }
    file(&folder.join("tracks.csv"), |out| table(out, result))?;
    file(&folder.join("tracks.kitti.txt"), |out| kitti(out, result, context))
}

/// States by frame, then identity.
fn by_frame(result: &RunResult) -> Vec<(&VehicleTrajectory, &VehicleState)> {
    let mut rows: Vec<_> =
        result.vehicles.iter().flat_map(|v| v.states.iter().map(move |s| (v, s))).collect();
    rows.sort_by_key(|(v, s)| (s.frame, v.id));
    rows
}

/// One row a vehicle and frame.
pub(super) fn table(out: impl Write, result: &RunResult) -> io::Result<()> {
    let mut table = TrackTable::new(out)?;
    for (vehicle, state) in by_frame(result) {
        table.write(&TrackRow {
            frame: &result.frames[state.frame],
            camera: &result.ego.frames[state.frame],
            id: vehicle.id,
            class: vehicle.class,
            sizes: [vehicle.size, vehicle.size_sigma()],
            p_moving: vehicle.p_moving,
            state,
        })?;
    }
    table.flush()
}

/// KITTI tracking results.
fn kitti(mut out: impl Write, result: &RunResult, context: &RunContext) -> io::Result<()> {
    for label in track_labels(result, context.camera_from_cam0) {
        writeln!(out, "{}", label.to_line())?;
    }
    Ok(())
}

/// Vehicles as KITTI tracking results: boxes go around the whole vehicle, as those of the labels; locations are bottom-face centres in rectified cam0
/// \[m\], `ry` about its y axis.
pub fn track_labels(result: &RunResult, camera_from_cam0: Pose<Camera, Cam0>) -> Vec<Label> {
    let cam0_from_camera = camera_from_cam0.inverse();
    let mut labels = Vec::new();
    for (vehicle, s) in by_frame(result) {
        let camera_from_world = result.ego.frames[s.frame].world_from_camera.inverse();
        // A detector's box ends where something hides the vehicle. Labels of KITTI go around the whole of it, and in a row of parked vehicles what shows of
        // one overlaps the label of the next one more than its own.
        let camera_from_vehicle = camera_from_world * s.world_from_vehicle;
        let whole = box_in_picture(&result.camera, &camera_from_vehicle, vehicle.class, &vehicle.size);
        let seen = s.bbox.filter(|_| s.source != Source::Predicted);
        let Some(bbox) = whole.or(seen) else { continue };
        let position = camera_from_world.transform_point(&Point3::from(s.world_from_vehicle.translation()));
        let location = cam0_from_camera.transform_point(&position);
        let forward =
            camera_from_world.transform_vector(&s.world_from_vehicle.transform_vector(&Vector3::x()));
        let forward = cam0_from_camera.transform_vector(&forward);
        // KITTI: ry = 0 faces +x, positive turns towards −z.
        let ry_rad = (-forward.z).atan2(forward.x);
        let alpha_rad = wrap(ry_rad - location.x.atan2(location.z));
        labels.push(Label {
            frame: result.frames[s.frame].number,
            track: vehicle.id as i64,
            class: kitti_class(vehicle.class).to_owned(),
            truncated: -1.0,
            occluded: -1.0,
            alpha_rad,
            bbox,
            size_hwl_m: [vehicle.size.height_m, vehicle.size.width_m, vehicle.size.length_m],
            location_m: [location.x, location.y, location.z],
            ry_rad,
            score: Some(s.score * probability_right(result, vehicle, s)),
        });
    }
    labels
}

/// Probability that the box is within a third of its length, width and height of the vehicle, by the standard deviations relative to
/// the camera. KITTI's evaluators rank boxes by score, and count those that overlap by half or more.
fn probability_right(result: &RunResult, vehicle: &VehicleTrajectory, state: &VehicleState) -> f64 {
    let size = &vehicle.size;
    let extents_m = [size.length_m, size.width_m, size.height_m];
    let sigma_m = sigma_from_camera(&result.ego.frames[state.frame], state);
    extents_m.iter().zip(sigma_m).map(|(m, sigma)| libm::erf(m / 3.0 / (SQRT_2 * sigma.max(1e-3)))).product()
}

/// Name of a class in KITTI's list, which has neither buses nor motorcycles; `tracks.csv` has our own names.
fn kitti_class(class: VehicleClass) -> &'static str {
    match class {
        VehicleClass::Bus => "Truck",
        VehicleClass::Motorcycle => "Misc",
        _ => class.name(),
    }
}

fn wrap(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite;
    use crate::test_results::{result, vehicle};
    use motorcade_geometry::{BoundingBox, lie::se3::adjoint};
    use nalgebra::{Matrix3, Matrix6, UnitQuaternion};

    #[test]
    fn classes_of_results_are_those_of_kitti() {
        const KITTI: [&str; 9] =
            ["Car", "Van", "Truck", "Pedestrian", "Person", "Cyclist", "Tram", "Misc", "DontCare"];
        for class in VehicleClass::ALL {
            assert!(KITTI.contains(&kitti_class(class)), "{class:?}");
        }
    }

    /// A half hidden vehicle has a whole box; a vehicle beside the camera, of which a part is in the picture, keeps the box of the detector.
    #[test]
    fn boxes_of_results_go_around_the_whole_vehicle() {
        let axes = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
        let labelled = |z_m: f64, bbox: Option<[f64; 4]>, source: Source| {
            let mut state = finite::tests::state(0.04);
            let at = Vector3::new(1.0, 1.5, z_m);
            state.world_from_vehicle = Pose::from_parts(UnitQuaternion::from_matrix(&axes), at);
            (state.bbox, state.source) = (bbox.map(BoundingBox::new), source);
            let result = result(1, vec![vehicle(5, vec![state])]);
            let found = track_labels(&result, Pose::identity());
            found.first().map(|label| label.bbox.to_array())
        };
        let whole = labelled(20.0, None, Source::Predicted).unwrap();
        assert!(whole[2] - whole[0] > 4.0 && whole[3] - whole[1] > 4.0, "{whole:?}");
        let half = [whole[0], whole[1], 0.5 * (whole[0] + whole[2]), whole[3]];
        assert_eq!(labelled(20.0, Some(half), Source::Box), Some(whole));
        assert_eq!(labelled(1.0, Some(half), Source::Box), Some(half));
        assert_eq!(labelled(1.0, Some(half), Source::Predicted), None);
    }

    /// Σ_relative = Σ_world − Ad Σ_camera Adᵀ along each axis of the vehicle, another way than the program takes.
    #[test]
    fn the_relative_columns_leave_the_camera_out() {
        let mut state = finite::tests::state(0.04);
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.8, 1.1);
        state.world_from_vehicle = Pose::from_parts(turn, Vector3::new(4.0, 1.5, 20.0));
        let world = Vector3::new(0.9, 0.7, 0.8);
        state.covariance.fixed_view_mut::<3, 3>(3, 3).set_diagonal(&world);
        let mut result = result(1, vec![vehicle(5, vec![state.clone()])]);
        let ego = &mut result.ego.frames[0];
        ego.covariance = Matrix6::from_diagonal(&[1e-4, 4e-4, 2e-4, 0.02, 0.01, 0.3].into());
        (ego.covariance[(1, 3)], ego.covariance[(3, 1)]) = (1e-3, 1e-3);
        let vehicle_from_camera = state.world_from_vehicle.inverse() * ego.world_from_camera;
        let across = adjoint(vehicle_from_camera.isometry());
        let camera = across * ego.covariance * across.transpose();

        let mut bytes = Vec::new();
        table(&mut bytes, &result).unwrap();
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let head = rows.headers().unwrap().clone();
        let row = rows.records().next().unwrap().unwrap();
        let cell =
            |name: String| -> f64 { row[head.iter().position(|h| h == name).unwrap()].parse().unwrap() };
        for (k, axis) in ["forward", "left", "up"].into_iter().enumerate() {
            let expected = (world[k] - camera[(3 + k, 3 + k)]).sqrt();
            assert!(camera[(3 + k, 3 + k)] > 0.02, "the camera has a part in {axis}: {camera}");
            assert!((cell(format!("sigma_relative_{axis}_m")) - expected).abs() < 2e-6, "{axis}: {row:?}");
            assert!((cell(format!("sigma_{axis}_m")) - world[k].sqrt()).abs() < 2e-6, "{axis}: {row:?}");
        }
    }
}
