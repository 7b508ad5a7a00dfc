//! Residual, Jacobians and normal equations of a measured motion between two poses; see [`Between`](super::Between)
//! for the equations. Generic over the register type and inlined into one function for each build.

use motorcade_sparse::simd::{Four, Kernel, Plain, dispatch};
use nalgebra::{Isometry3, Matrix6, Quaternion};

use super::blocks::{LowerBlocks, Symmetric, put};
use super::mat3::{Lanes, Mat3, cross, dot, lanes};
use super::pose_residual::PoseResidual;

/// Two poses `world_from_body` and what was measured between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseError<'a> {
    pub first: &'a Isometry3<f64>,
    pub second: &'a Isometry3<f64>,
    /// `Z = first_from_second`.
    pub measurement: &'a Isometry3<f64>,
    /// Ω by columns, `[ω, ν]` order.
    pub information: &'a [[f64; 6]; 6],
    pub residual: PoseResidual,
}

/// The error motion `E = Z⁻¹ Xi⁻¹ Xj` and `Xj⁻¹ Xi`.
struct Motions<V> {
    /// Rotation and translation of `Xj⁻¹ Xi`.
    rotation: Mat3<V>,
    translation: Lanes,
    /// The same of E; its quaternion has w ≥ 0.
    error_q: Quaternion<f64>,
    error_rotation: Mat3<V>,
    error_t: Lanes,
}

impl PoseError<'_> {
    #[inline(always)]
    fn motions<V: Four>(&self) -> Motions<V> {
        let (qi, qj) = (self.first.rotation.quaternion(), self.second.rotation.quaternion());
        let back = conjugate(qj);
        let q = product(&back, qi);
        let rotation: Mat3<V> = Mat3::rotation(&q);
        let apart = self.first.translation.vector - self.second.translation.vector;
        let translation = Mat3::<V>::rotation(&back).times(&lanes(&apart)).get();
        // E⁻¹ = (Xj⁻¹ Xi) Z
        let inverse = product(&q, self.measurement.rotation.quaternion());
        let z = rotation.times(&lanes(&self.measurement.translation.vector)).get();
        let t: Lanes = [-(translation[0] + z[0]), -(translation[1] + z[1]), -(translation[2] + z[2]), 0.0];
        let error_q = conjugate(&inverse);
        let error_q = if error_q.w < 0.0 { -error_q } else { error_q };
        let error_rotation: Mat3<V> = Mat3::rotation(&error_q);
        let error_t = error_rotation.times(&t).get();
        Motions { rotation, translation, error_q, error_rotation, error_t }
    }
}

/// `[ω, ν]` of the residual, and how far the rotation is turned.
struct Residual {
    w: Lanes,
    v: Lanes,
    turn: Turn,
}

/// The angle of a rotation, |ω| ≤ π.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    /// ω·ω \[rad²\].
    t2: f64,
    /// Sine and cosine of half the angle; none for small ones, which take series.
    half: Option<(f64, f64)>,
}

/// Squared sine of half the angle (0.2 rad in all) below which the series here are exact to the last bits. Residuals near
/// the minimum are that small; they are spared three square roots, four divisions and an arc tangent, all in one chain.
const SMALL: f64 = 0.01;

/// `Σ c_k x^k`.
#[inline(always)]
fn series<const N: usize>(x: f64, c: [f64; N]) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// `asin(n) / n` of n².
const ARC_SINE: [f64; 9] = [
    1.0,
    1.0 / 6.0,
    3.0 / 40.0,
    5.0 / 112.0,
    35.0 / 1152.0,
    63.0 / 2816.0,
    231.0 / 13312.0,
    143.0 / 10240.0,
    6435.0 / 557_056.0,
];

impl Residual {
    #[inline(always)]
    fn new<V: Four>(kind: PoseResidual, m: &Motions<V>) -> Self {
        let q = &m.error_q;
        let imaginary = [q.i, q.j, q.k, 0.0];
        if kind == PoseResidual::Mqt {
            return Self { w: imaginary, v: m.error_t, turn: Turn { t2: 0.0, half: None } };
        }
        let n2 = dot(&imaginary, &imaginary);
        let (factor, half) = if n2 < SMALL {
            (2.0 * series(n2, ARC_SINE), None)
        } else {
            // atan2 keeps its precision near π.
            let n = n2.sqrt();
            (2.0 * n.atan2(q.w) / n, Some((n, q.w)))
        };
        let w = [q.i * factor, q.j * factor, q.k * factor, 0.0];
        let turn = Turn { t2: dot(&w, &w), half };
        // Jl⁻¹(ω) t = t − ½ ω×t + c ω×(ω×t)
        let wt = cross(&w, &m.error_t);
        let v = {
            let (c, wwt) = (turn.inverse_coefficient(), cross(&w, &wt));
            let at = |k: usize| m.error_t[k] - 0.5 * wt[k] + c * wwt[k];
            [at(0), at(1), at(2), 0.0]
        };
        Self { w, v, turn }
    }
}

impl Turn {
    #[cfg(test)]
    pub(super) fn of(w: &nalgebra::Vector3<f64>) -> Self {
        let t2 = w.norm_squared();
        let (sin, cos) = (0.5 * t2.sqrt()).sin_cos();
        Self { t2, half: (sin * sin >= SMALL).then_some((sin, cos)) }
    }

    /// c of `Jl⁻¹ = I − ½ω^ + c ω^ω^`.
    #[inline(always)]
    fn inverse_coefficient(self) -> f64 {
        let t2 = self.t2;
        let Some((sin, cos)) = self.half else {
            // |B_2k| / (2k)!, Bernoulli's numbers
            const C: [f64; 6] = [
                1.0 / 12.0,
                1.0 / 720.0,
                1.0 / 30_240.0,
                1.0 / 1_209_600.0,
                1.0 / 47_900_160.0,
                691.0 / 1_307_674_368_000.0,
            ];
            return series(t2, C);
        };
        (1.0 - 0.5 * t2.sqrt() * cos / sin) / t2
    }

    /// Coefficients of Barfoot eq. 8.91 as in `motorcade_geometry::lie::se3`.
    #[inline(always)]
    fn q_coefficients(self) -> (f64, f64, f64) {
        let t2 = self.t2;
        let Some((sin, cos)) = self.half else {
            return (
                series(
                    t2,
                    [
                        1.0 / 6.0,
                        -1.0 / 120.0,
                        1.0 / 5040.0,
                        -1.0 / 362_880.0,
                        1.0 / 39_916_800.0,
                        -1.0 / 6_227_020_800.0,
                    ],
                ),
                series(
                    t2,
                    [
                        1.0 / 24.0,
                        -1.0 / 720.0,
                        1.0 / 40_320.0,
                        -1.0 / 3_628_800.0,
                        1.0 / 479_001_600.0,
                        -1.0 / 87_178_291_200.0,
                    ],
                ),
                // (k − 1) / (2k + 1)! from k = 2 on
                series(
                    t2,
                    [
                        1.0 / 120.0,
                        -1.0 / 2520.0,
                        1.0 / 120_960.0,
                        -1.0 / 9_979_200.0,
                        1.0 / 1_245_404_160.0,
                        -1.0 / 217_945_728_000.0,
                    ],
                ),
            );
        };
        let (t, t4) = (t2.sqrt(), t2 * t2);
        let (s, k) = (2.0 * sin * cos, 1.0 - 2.0 * sin * sin);
        ((t - s) / (t2 * t), (t2 + 2.0 * k - 2.0) / (2.0 * t4), (2.0 * t - 3.0 * s + t * k) / (2.0 * t4 * t))
    }
}

/// `Jr⁻¹` of SE(3) at `[ω, ν]` as blocks: `[[J, 0], [−J Q J, J]]` with `J = I + ½ω^ + c ω^ω^` and Barfoot's Q at
/// (−ω, −ν). With `P = ω^`, `N = ν^`, `s = ω·ν`: `PNP = −s P`, so Q is a sum of P, N, PN + NP and PPN + NPP alone.
#[inline(always)]
pub(super) fn log_jacobian<V: Four>(w: &Lanes, v: &Lanes, turn: Turn) -> LowerBlocks<V> {
    let t2 = turn.t2;
    let c1 = turn.inverse_coefficient();
    // ω^ω^ = ωωᵀ − |ω|² I
    let j = Mat3::identity(1.0 - t2 * c1).plus(&Mat3::hat(w, 0.5)).plus_outer(c1, w, w);
    let (a, b, c) = turn.q_coefficients();
    let s = dot(w, v);
    // −Q = odd − a (PN + NP) + 2cs PP with PN + NP = ωνᵀ + νωᵀ − 2s I, PPN + NPP = −|ω|² N − s P,
    // PNPP + PPNP = −2s PP
    let minus_q = Mat3::hat(v, 0.5 - b * t2)
        .plus(&Mat3::hat(w, s * (2.0 * b - a)))
        .plus(&Mat3::identity(2.0 * s * (a - c * t2)))
        .plus_outer(-a, w, v)
        .plus_outer(-a, v, w)
        .plus_outer(2.0 * c * s, w, w);
    LowerBlocks { u: j.mul(&minus_q), a: j, c: j }
}

#[inline(always)]
fn jacobian<V: Four>(kind: PoseResidual, m: &Motions<V>, r: &Residual) -> LowerBlocks<V> {
    match kind {
        PoseResidual::Log => log_jacobian::<V>(&r.w, &r.v, r.turn),
        PoseResidual::Mqt => LowerBlocks {
            a: Mat3::identity(0.5 * m.error_q.w).plus(&Mat3::hat(&r.w, 0.5)),
            u: Mat3::identity(0.0),
            c: m.error_rotation,
        },
    }
}

/// `Ad(Xj⁻¹ Xi) = [[R, 0], [t^ R, R]]`.
#[inline(always)]
fn adjoint<V: Four>(m: &Motions<V>) -> LowerBlocks<V> {
    LowerBlocks { u: Mat3::hat(&m.translation, 1.0), a: m.rotation, c: m.rotation }
}

/// Residual, J_i and J_j.
pub(super) fn linearise(at: &PoseError<'_>) -> (Lanes, Lanes, Matrix6<f64>, Matrix6<f64>) {
    let m = at.motions::<Plain>();
    let r = Residual::new(at.residual, &m);
    let j = jacobian::<Plain>(at.residual, &m, &r).to_matrix();
    (r.w, r.v, -j * adjoint(&m).to_matrix(), j)
}

/// `[ω, ν]` of the residual.
pub(super) fn residual(at: &PoseError<'_>) -> (Lanes, Lanes) {
    let r = Residual::new(at.residual, &at.motions::<Plain>());
    (r.w, r.v)
}

/// `Ω [x; y]` and the square.
#[inline(always)]
fn weigh<V: Four>(r: &Residual, o: &Symmetric<V>) -> (Lanes, Lanes, f64) {
    let (px, qx) = (o.p.times(&r.w), o.q.times(&r.w));
    let (qy, sy) = (o.q.transpose().times(&r.v), o.s.times(&r.v));
    let (x, y) = (px.add(qy).get(), qx.add(sy).get());
    (x, y, dot(&r.w, &x) + dot(&r.v, &y))
}

struct SquaredNorm<'a>(&'a PoseError<'a>);

impl Kernel for SquaredNorm<'_> {
    type Output = f64;
    #[inline(always)]
    fn run<V: Four>(self) -> f64 {
        let r = Residual::new(self.0.residual, &self.0.motions::<V>());
        weigh::<V>(&r, &Symmetric::<V>::new(self.0.information)).2
    }
}

/// `rᵀ Ω r`.
pub(super) fn squared_norm(at: &PoseError<'_>) -> f64 {
    dispatch(SquaredNorm(at))
}

struct NormalEquations<'a> {
    at: &'a PoseError<'a>,
    g: &'a mut [f64; 12],
    h: &'a mut [f64; 144],
}

impl Kernel for NormalEquations<'_> {
    type Output = f64;
    #[inline(always)]
    fn run<V: Four>(self) -> f64 {
        fill::<V>(self.at, self.g, self.h)
    }
}

/// Writes g (12) and the lower triangle of H (12×12, column-major); returns `rᵀ Ω r`.
pub(super) fn normal_equations(at: &PoseError<'_>, g: &mut [f64; 12], h: &mut [f64; 144]) -> f64 {
    dispatch(NormalEquations { at, g, h })
}

#[inline(always)]
fn fill<V: Four>(at: &PoseError<'_>, g: &mut [f64; 12], h: &mut [f64; 144]) -> f64 {
    let m = at.motions::<V>();
    let r = Residual::new(at.residual, &m);
    let information = Symmetric::new(at.information);
    let (wx, wy, s) = weigh::<V>(&r, &information);
    let jacobian = jacobian::<V>(at.residual, &m, &r);
    let (_, a) = jacobian.congruence(&information);
    let (gx, gy) = jacobian.tr_mul(V::new(wx), V::new(wy));
    let ad = adjoint(&m);
    let (a_ad, ii) = ad.congruence(&a);
    let (fx, fy) = ad.tr_mul(gx, gy);
    put_vector(g, 0, fx.scale(-1.0), fy.scale(-1.0));
    put_vector(g, 6, gx, gy);
    let zero = Mat3::identity(0.0);
    put(h, (0, 0), &ii.p, &ii.q, 1.0);
    put(h, (0, 3), &zero, &ii.s, 1.0);
    put(h, (6, 0), &a_ad[0], &a_ad[2], -1.0);
    put(h, (6, 3), &a_ad[1], &a_ad[3], -1.0);
    put(h, (6, 6), &a.p, &a.q, 1.0);
    put(h, (6, 9), &zero, &a.s, 1.0);
    s
}

/// Writes `[x; y]` from row `at` on.
#[inline(always)]
fn put_vector<V: Four>(g: &mut [f64; 12], at: usize, x: V, y: V) {
    let (four, two) = V::join(x, y);
    g[at..at + 4].copy_from_slice(&four);
    g[at + 4..at + 6].copy_from_slice(&two);
}

#[inline(always)]
fn conjugate(q: &Quaternion<f64>) -> Quaternion<f64> {
    Quaternion::new(q.w, -q.i, -q.j, -q.k)
}

#[inline(always)]
fn product(a: &Quaternion<f64>, b: &Quaternion<f64>) -> Quaternion<f64> {
    Quaternion::new(
        a.w * b.w - a.i * b.i - a.j * b.j - a.k * b.k,
        a.w * b.i + a.i * b.w + a.j * b.k - a.k * b.j,
        a.w * b.j - a.i * b.k + a.j * b.w + a.k * b.i,
        a.w * b.k + a.i * b.j - a.j * b.i + a.k * b.w,
    )
}

#[cfg(test)]
mod tests {
    use super::super::blocks::join;
    use super::*;
    use motorcade_geometry::lie::se3;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn block_jacobian_is_the_one_of_the_group(a in proptest::array::uniform6(-1.8..1.8), small in 1e-4..1.0) {
            let w = Vector3::new(a[0], a[1], a[2]) * small;
            let v = Vector3::new(a[3], a[4], a[5]);
            let expected = se3::right_jacobian_inverse(&join(&w, &v));
            let ours = log_jacobian::<Plain>(&lanes(&w), &lanes(&v), Turn::of(&w)).to_matrix();
            prop_assert!((ours - expected).norm() < 1e-11);
        }
    }
}
