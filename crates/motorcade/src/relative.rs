//! Uncertainty of a vehicle's position relative to the camera.

use motorcade_geometry::{Camera, Pose, Vehicle};
use nalgebra::{Matrix3, Matrix3x6, Matrix6};

/// Least standard deviation relative to the camera, as a share of that in the world. Chosen; it holds where the two poses are correlated, so that the
/// difference of their covariances is too small. No option: tables, the report and drawings of a run that is read back, which has no
/// configuration there, have to agree.
const LEAST_SHARE: f64 = 0.1;

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
        assert!((forward - 0.02).abs() < 1e-9, "{forward}");
    }
}
