//! Shift of a whole picture that no motion of the camera explains: a crop or another offset of the sensor.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, robust::RobustKernel};
use nalgebra::{SMatrix, SVector, Vector2};

use super::pose_only::Observation;
use super::reprojection::{add_outer, reprojection};

/// Jumps of the principal point. A pitch of θ moves pixels at the edges by (y/f)² more than those at the centre and those in the corners
/// sideways, so that wide pictures tell it from a shift by the same number of pixels.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PictureShiftOptions {
    /// Least shift that is reported \[px\]. Five real drives without a fault have 2.7 px at most, because landmarks whose depth is wrong act as a small
    /// shift; a larger value misses smaller crops.
    pub least_px: f64,
    /// Standard deviations that a shift must have; less lets pictures with few corners show shifts that are none.
    pub least_sigmas: f64,
    /// Rotation against the predicted one that is left without the shift, as image motion over the shift: cameras turn on as they did. A larger
    /// value admits shifts that make up for wrong depths.
    pub most_rest: f64,
    /// Iterations of the fit.
    pub iterations: usize,
}

impl Default for PictureShiftOptions {
    fn default() -> Self {
        Self { least_px: 4.0, least_sigmas: 5.0, most_rest: 0.45, iterations: 8 }
    }
}

/// Shift \[px\] of the pixels of a frame against their projections, estimated together with the camera's pose, which begins at `start`. `None`
/// where it is smaller than the options ask for, where the corners do not tell it from a rotation, or where the camera without it does not move
/// on as predicted.
pub(crate) fn picture_shift(
    camera: &PinholeCamera,
    (predicted, start): (&Pose<Camera, World>, &Pose<Camera, World>),
    observations: &[Observation],
    noise_px: f64,
    kernel_px: f64,
    options: &PictureShiftOptions,
) -> Option<Vector2<f64>> {
    let kernel = RobustKernel::Cauchy(kernel_px);
    let (mut pose, mut shift) = (*start, Vector2::zeros());
    let mut covariance = SMatrix::<f64, 8, 8>::zeros();
    for _ in 0..options.iterations {
        let (mut h, mut g) = (SMatrix::<f64, 8, 8>::zeros(), SMatrix::<f64, 8, 1>::zeros());
        for o in observations {
            let Some((r, by_pose, _)) = reprojection(camera, &pose, &o.point_in_world, &o.pixel) else {
                continue;
            };
            let r = r + shift;
            // [∂r/∂ω ∂r/∂ν ∂r/∂s] (2×8)
            let mut j = SMatrix::<f64, 2, 8>::identity();
            j.fixed_columns_mut::<6>(0).copy_from(&by_pose);
            j.fixed_columns_mut::<2>(6).copy_from(&SMatrix::<f64, 2, 2>::identity());
            let w = kernel.weight(r.norm_squared());
            add_outer(&mut h, &j, &j, w);
            add_outer(&mut g, &j, &r, w);
        }
        let factor = h.cholesky()?;
        let step: SVector<f64, 8> = factor.solve(&-g);
        pose = pose.retract(&step.fixed_rows::<6>(0).into_owned());
        shift += step.fixed_rows::<2>(6);
        covariance = factor.inverse();
    }
    let length = shift.norm();
    let along = shift / length.max(1e-9);
    let sigma = noise_px * along.dot(&(covariance.fixed_view::<2, 2>(6, 6) * along)).max(0.0).sqrt();
    let rest_px = camera.fx.max(camera.fy) * (pose.rotation() * predicted.rotation().inverse()).angle();
    let clear = length.is_finite()
        && length > options.least_px.max(options.least_sigmas * sigma)
        && rest_px < options.most_rest * length;
    clear.then_some(shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::CAMERA;
    use nalgebra::{Point3, Vector6};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn found(turn_rad: f64, shift_px: Vector2<f64>) -> Option<Vector2<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let truth: Pose<Camera, World> = Pose::exp(&Vector6::new(turn_rad, 0.0, 0.0, 0.0, 0.0, -0.8));
        let mut observation = || {
            let (x, y, z) =
                (rng.random_range(-8.0..8.0), rng.random_range(-3.0..1.6), rng.random_range(8.0..50.0));
            let point_in_world = Point3::new(x, y, z);
            let noise = Vector2::new(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5));
            let pixel = CAMERA.project(&truth.transform_point(&point_in_world)).unwrap() + shift_px + noise;
            Observation { point_in_world, pixel }
        };
        let ahead = Pose::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -0.8));
        let observations: Vec<Observation> = (0..200).map(|_| observation()).collect();
        picture_shift(&CAMERA, (&ahead, &ahead), &observations, 0.3, 1.0, &PictureShiftOptions::default())
    }

    #[test]
    fn a_shift_is_told_from_a_pitch_that_moves_the_centre_as_far() {
        let shift_px = Vector2::new(0.0, -10.0);
        let shift = found(0.0, shift_px).unwrap();
        assert!((shift - shift_px).norm() < 1.0, "{shift}");
        assert_eq!(found(-10.0 / CAMERA.fy, Vector2::zeros()), None);
        assert_eq!(found(0.0, Vector2::zeros()), None);
        // A camera that turns against the prediction too is not judged.
        assert_eq!(found(-10.0 / CAMERA.fy, shift_px), None);
    }
}
