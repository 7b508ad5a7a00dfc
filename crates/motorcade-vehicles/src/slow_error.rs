//! A vehicle's motion when places err along the ray for seconds on end.
//!
//! What a box says of depth errs by the vehicle's size, the plane's pitch, the road's slope and the detector's habit, and all of them
//! last: only the jitter of the box's edges is new in every frame. Taken as independent such errors average out over a second
//! and leave a speed that is far too certain. Here
//!
//! ```text
//! z_k = p(t_k) + c g_k u(t_k) + n_k      cov n_k = Σ_k − c² g_k g_kᵀ      g_k = Σ_k ray_k / √(ray_kᵀ Σ_k ray_k)
//! ```
//!
//! with u an Ornstein–Uhlenbeck process of variance 1: a lasting error stays the same share of the standard deviation along the
//! ray, hence of the distance, and feigns motion as the distance changes. g is what goes with an error of depth in all axes, so
//! that the rest is a covariance (Schur).

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

use crate::motion::{Place, process_noise, transition};

/// c²: share of the variance along the ray that lasts.
const LASTING: f64 = 0.8;
/// How long \[s\]: the time in which distance, side and road under a vehicle in traffic become others.
const LASTS_S: f64 = 2.0;
/// Boxes that are cut by something nobody has recognised: a share of all.
const CUT: f64 = 0.1;

/// No place is known better \[m\].
const LEAST_M: f64 = 0.02;

/// Unknowns: place, velocity, the lasting error.
const STATE: usize = 7;
type State = SVector<f64, STATE>;
type Covariance = SMatrix<f64, STATE, STATE>;

/// Place \[m\] and velocity \[m/s\] in the world with the lasting error, filtered forward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlowErrorFilter {
    pub(crate) x: State,
    pub(crate) p: Covariance,
    /// Acceleration density per axis (3×3) \[m²/s³\].
    density: Matrix3<f64>,
}

impl SlowErrorFilter {
    /// Nothing known of the place but that it is near `around`; velocity with this covariance.
    pub(crate) fn new(around: &Vector3<f64>, velocity: &Matrix3<f64>, density: Matrix3<f64>) -> Self {
        /// Further than any vehicle is told from where it was first seen \[m\].
        const ANYWHERE_M: f64 = 100.0;
        let (mut x, mut p) = (State::zeros(), Covariance::zeros());
        x.fixed_rows_mut::<3>(0).copy_from(around);
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * ANYWHERE_M.powi(2)));
        p.fixed_view_mut::<3, 3>(3, 3).copy_from(velocity);
        p[(6, 6)] = 1.0;
        Self { x, p, density }
    }

    /// Goes on by `dt` \[s\]; returns the transition (7×7).
    pub(crate) fn predict(&mut self, dt: f64) -> Covariance {
        let decay = (-dt / LASTS_S).exp();
        let (mut f, mut q) = (Covariance::zeros(), Covariance::zeros());
        f.fixed_view_mut::<6, 6>(0, 0).copy_from(&transition(dt));
        f[(6, 6)] = decay;
        q.fixed_view_mut::<6, 6>(0, 0).copy_from(&process_noise(dt, &self.density));
        q[(6, 6)] = 1.0 - decay * decay;
        self.x = f * self.x;
        self.p = f * self.p * f.transpose() + q;
        f
    }

    /// Takes a place; one that is likelier cut than right has little weight.
    pub(crate) fn update(&mut self, place: &Place) {
        let toward = place.covariance * place.ray;
        let lasting = toward * (LASTING / place.ray.dot(&toward).max(1e-9)).sqrt();
        let own = place.covariance - lasting * lasting.transpose() + Matrix3::identity() * LEAST_M.powi(2);
        // ∂z/∂[p, v, u] = [I, 0, c g]   (3×7)
        let mut h = SMatrix::<f64, 3, STATE>::zeros();
        h.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        h.fixed_view_mut::<3, 1>(0, 6).copy_from(&lasting);
        let innovation = place.position - h * self.x;
        let spread = h * self.p * h.transpose();
        // Half of a vehicle taken for the whole is up to twice as far away.
        let anywhere = place.ray * place.ray.transpose() * (0.5 * place.range_m).powi(2)
            + Matrix3::identity() * (0.1 * place.range_m).powi(2);
        let right = log_density(&innovation, &(spread + own)) + (1.0 - CUT).ln();
        let cut = log_density(&innovation, &(spread + own + anywhere)) + CUT.ln();
        let both = right.max(cut) + (-(right - cut).abs()).exp().ln_1p();
        let weight = (right - both).exp().max(1e-4);
        let noise = own / weight;
        let Some(inverse) = (spread + noise).try_inverse() else { return };
        let gain = self.p * h.transpose() * inverse;
        self.x += gain * innovation;
        // Joseph's form: the place is known to 100 m at first and to centimetres later.
        let left = Covariance::identity() - gain * h;
        self.p = left * self.p * left.transpose() + gain * noise * gain.transpose();
        self.p = (self.p + self.p.transpose()) * 0.5;
    }

    /// Place and velocity.
    pub(crate) fn motion(x: &State, p: &Covariance) -> (Vector6<f64>, Matrix6<f64>) {
        (x.fixed_rows::<6>(0).into_owned(), p.fixed_view::<6, 6>(0, 0).into_owned())
    }
}

/// Standard deviation of what a lasting error changes by over a time \[s\], as a share of the error along the ray:
/// `c √(2 (1 − e^{−t/τ}))`.
pub(crate) fn lasting_drift(duration_s: f64) -> f64 {
    (2.0 * LASTING * (1.0 - (-duration_s / LASTS_S).exp())).sqrt()
}

/// Logarithm of the normal density; far below any other for a covariance that is none.
fn log_density(innovation: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    let Some(factor) = covariance.cholesky() else { return -1e6 };
    let log_det = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    -0.5 * (innovation.dot(&factor.solve(innovation)) + log_det + 3.0 * std::f64::consts::TAU.ln())
}
