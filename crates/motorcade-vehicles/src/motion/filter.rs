//! Kalman filter of a vehicle's position and velocity in the world.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::options::MotionOptions;

/// Filtered position and velocity.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct MotionFilter {
    /// Position \[m\], velocity \[m/s\], world.
    pub(crate) x: Vector6<f64>,
    /// Covariance of both (6×6).
    pub(crate) p: Matrix6<f64>,
}

impl MotionFilter {
    /// At a measured position, with unknown velocity.
    pub(crate) fn new(position: &Vector3<f64>, covariance: &Matrix3<f64>, options: &MotionOptions) -> Self {
        let (mut x, mut p) = (Vector6::zeros(), Matrix6::zeros());
        x.fixed_rows_mut::<3>(0).copy_from(position);
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(covariance);
        let velocity_variance = options.initial_speed_sigma_mps.powi(2);
        p.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * velocity_variance));
        Self { x, p }
    }

    /// Predicts `dt` \[s\] ahead on a road of normal `up` (world); returns the transition (6×6).
    pub(crate) fn predict(&mut self, dt: f64, up: &Vector3<f64>, options: &MotionOptions) -> Matrix6<f64> {
        let vertical = up * up.transpose();
        let density = (Matrix3::identity() - vertical) * options.acceleration_density.powi(2)
            + vertical * options.vertical_density.powi(2);
        let f = transition(dt);
        self.x = f * self.x;
        self.p = f * self.p * f.transpose() + process_noise(dt, &density);
        f
    }

    /// Updates with a measured position; beyond the gate it loses weight.
    pub(crate) fn update(
        &mut self,
        position: &Vector3<f64>,
        covariance: &Matrix3<f64>,
        options: &MotionOptions,
    ) {
        let Self { x, p } = self;
        let innovation = position - x.fixed_rows::<3>(0);
        let predicted: Matrix3<f64> = p.fixed_view::<3, 3>(0, 0).into_owned();
        let Some(inverse) = (predicted + covariance).try_inverse() else { return };
        let d2 = innovation.dot(&(inverse * innovation));
        let weight = (options.gate_chi2 / d2.max(1e-12)).min(1.0);
        let Some(inverse) = (predicted + covariance / weight).try_inverse() else { return };
        let gain = p.fixed_columns::<3>(0) * inverse;
        *x += gain * innovation;
        *p -= gain * p.fixed_rows::<3>(0);
        *p = (*p + p.transpose()) * 0.5;
    }
}

fn transition(dt: f64) -> Matrix6<f64> {
    let mut f = Matrix6::identity();
    f.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Matrix3::identity() * dt));
    f
}

/// Q = q [[dt³/3, dt²/2], [dt²/2, dt]] per axis, of continuous-time white-noise acceleration of density q \[m²/s³\].
fn process_noise(dt: f64, density: &Matrix3<f64>) -> Matrix6<f64> {
    let mut q = Matrix6::zeros();
    q.fixed_view_mut::<3, 3>(0, 0).copy_from(&(density * (dt.powi(3) / 3.0)));
    q.fixed_view_mut::<3, 3>(0, 3).copy_from(&(density * (dt * dt / 2.0)));
    q.fixed_view_mut::<3, 3>(3, 0).copy_from(&(density * (dt * dt / 2.0)));
    q.fixed_view_mut::<3, 3>(3, 3).copy_from(&(density * dt));
    q
}
