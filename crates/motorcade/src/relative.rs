//! Uncertainty of a vehicle's position relative to the camera.

use motorcade_geometry::lie::se3::adjoint;
use motorcade_geometry::{Camera, Pose, Vehicle};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::{Matrix3, Matrix3x6, Matrix6};

/// Least standard deviation relative to the camera, as a share of that in the world: the difference of two variances that files state with six
/// decimals is no better, and rounding may leave nothing of it. No option: tables, the report and drawings of a run that is read back, which has no
/// configuration there, have to agree.
const LEAST_SHARE: f64 = 1e-3;

/// Adds the covariance of the camera's pose to states that have that relative to it, as the front end makes them and the multi-object graph does not:
/// Σ_world = Σ_relative + Ad Σ_camera Adᵀ (6×6 `[ω, ν]`, vehicle frame).
pub(crate) fn add_camera(ego: &EgoTrajectory, vehicles: &mut [VehicleTrajectory]) {
    for state in vehicles.iter_mut().flat_map(|v| &mut v.states) {
        let Some(camera) = ego.frames.get(state.frame) else { continue };
        let vehicle_from_camera = state.world_from_vehicle.inverse() * camera.world_from_camera;
        let across = adjoint(vehicle_from_camera.isometry());
        state.covariance += across * camera.covariance * across.transpose();
    }
}

/// Replaces the camera's part in the covariance of a state in the world, when the pose of that camera becomes known otherwise. Vehicle and camera are
/// both still in the world of `before`.
pub(crate) fn exchange_camera(state: &mut VehicleState, before: &EgoFrame, after: &EgoFrame) {
    let vehicle_from_camera = state.world_from_vehicle.inverse() * before.world_from_camera;
    let across = adjoint(vehicle_from_camera.isometry());
    let by = |camera: &EgoFrame| across * camera.covariance * across.transpose();
    let relative = (state.covariance - by(before)).symmetric_eigen();
    // Rounding, and a camera that the vehicles themselves made better known, leave less than nothing in some directions.
    let least = LEAST_SHARE * LEAST_SHARE * state.covariance.diagonal().min().max(0.0);
    let kept = Matrix6::from_diagonal(&relative.eigenvalues.map(|value| value.max(least)));
    state.covariance = relative.eigenvectors * kept * relative.eigenvectors.transpose() + by(after);
}

/// Standard deviations of a vehicle's position relative to the camera, along its forward, left and up axes \[m\]. Those in the
/// world contain the drift of the camera since the first frame: Σ_world = Σ_relative + J Σ_camera Jᵀ.
///
/// `camera` is the covariance of the camera's pose (6×6 `[ω, ν]`, camera frame), `sigma_m` are the deviations in the world along the
/// vehicle's axes.
pub fn relative_sigma_m(
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    camera: &Matrix6<f64>,
    sigma_m: [f64; 3],
) -> [f64; 3] {
    // A point p of the camera moves by ν + ω × p in it: J = [−[p]× | I].
    let p = camera_from_vehicle.translation();
    let mut jacobian = Matrix3x6::zeros();
    jacobian.fixed_columns_mut::<3>(0).copy_from(&-p.cross_matrix());
    jacobian.fixed_columns_mut::<3>(3).copy_from(&Matrix3::identity());
    let r = camera_from_vehicle.rotation_matrix();
    let by_camera = r.transpose() * (jacobian * camera * jacobian.transpose()) * r;
    std::array::from_fn(|k| {
        let world = sigma_m[k] * sigma_m[k];
        (world - by_camera[(k, k)]).max(LEAST_SHARE * LEAST_SHARE * world).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite;
    use crate::test_results::vehicle;
    use nalgebra::Vector3;

    #[test]
    fn the_drift_of_the_camera_is_left_out() {
        // Heading along the view, 20 m ahead; the camera 0.3 m uncertain along its axis and 0.01 rad about the vertical.
        let rotation = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
        let pose = Pose::<Camera, Vehicle>::from_matrix(&rotation, &Vector3::new(0.0, 1.5, 20.0));
        let mut covariance = Matrix6::zeros();
        covariance[(5, 5)] = 0.09;
        covariance[(1, 1)] = 1e-4;
        let [forward, left, up] = relative_sigma_m(&pose, &covariance, [0.5, 0.25, 0.1]);
        assert!((forward - 0.4).abs() < 1e-9, "{forward}");
        assert!((left - 0.15).abs() < 1e-9, "20 m at 0.01 rad are 0.2 m: {left}");
        assert!((up - 0.1).abs() < 1e-9, "{up}");
        // Known better in the world than the camera is: not nothing.
        let [forward, _, _] = relative_sigma_m(&pose, &covariance, [0.2, 0.25, 0.1]);
        assert!((forward - 2e-4).abs() < 1e-9, "{forward}");
    }

    #[test]
    fn the_camera_is_added_and_left_out_again() {
        let camera = EgoFrame { covariance: Matrix6::identity() * 4.0, ..finite::tests::frame() };
        let ego = EgoTrajectory { frames: vec![camera], height_m: 1.6, noise: Vec::new() };
        let mut vehicle = vehicle(1, vec![finite::tests::state(0.04)]);
        add_camera(&ego, std::slice::from_mut(&mut vehicle));
        let state = &vehicle.states[0];
        let sigma_m = std::array::from_fn(|k| state.covariance[(3 + k, 3 + k)].sqrt());
        assert!(sigma_m.iter().all(|s: &f64| *s > 2.0), "{sigma_m:?}");
        let camera_from_vehicle = ego.frames[0].world_from_camera.inverse() * state.world_from_vehicle;
        for own in relative_sigma_m(&camera_from_vehicle, &ego.frames[0].covariance, sigma_m) {
            assert!((own - 0.2).abs() < 1e-9, "{own}");
        }
    }
}
