//! Normal equations of the road alignment.

use motorcade_geometry::{lie::so3, robust::RobustKernel};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::options::{AlignmentOptions, RoadOptions};
use super::view::{RoadView, Sample};

/// Parameters of the alignment.
pub(super) struct State {
    pub m: Vector3<f64>,
    /// Correction of the rotation \[rad\].
    pub turn: Vector3<f64>,
    pub gain: f64,
    /// Grey offset \[grey levels\].
    pub offset: f64,
    /// Vertical curvature of the road over twice the camera's height, c in `1/z = mᵀx + c/(mᵀx)`: foot or crest of a hill.
    pub curvature: f64,
}

/// m (3), small rotation (3), gain and offset of the grey values (2), curvature (1).
pub(super) const PARAMETERS: usize = 9;
/// Parameters of the result: m and curvature.
pub(super) const KEPT: [usize; 4] = [0, 1, 2, 8];
type NormalEquations = (SMatrix<f64, PARAMETERS, PARAMETERS>, SVector<f64, PARAMETERS>);

/// Normal equations of the grey residuals; `absolute` receives their absolute values.
pub(super) fn accumulate(
    view: &RoadView<'_>,
    samples: &[Sample],
    level: usize,
    state: &State,
    sigma: f64,
    options: &AlignmentOptions,
    absolute: &mut Vec<f64>,
) -> NormalEquations {
    let reference = view.reference.level(level);
    let scale = 1.0 / f64::from(1u32 << level);
    let turn = so3::exp(&state.turn).to_rotation_matrix().into_inner();
    let r = turn * view.reference_from_current.rotation_matrix();
    let t = turn * view.reference_from_current.translation();
    let turning = so3::log(&view.reference_from_current.rotation());
    let kernel = RobustKernel::Cauchy(options.kernel_sigmas * sigma);
    let (fx, fy) = (view.camera.fx * scale, view.camera.fy * scale);
    let (cx, cy) = (view.camera.cx * scale, view.camera.cy * scale);
    let (mut h, mut g): NormalEquations = (SMatrix::zeros(), SVector::zeros());
    absolute.clear();
    absolute.reserve(samples.len());
    for s in samples {
        let flat = state.m.dot(&s.ray);
        // Motion at constant velocity over the time between the two rows.
        let t = t * (1.0 + s.longer);
        let x = &s.ray;
        let inverse_depth = flat + state.curvature / flat;
        let y = Vector3::new(
            r.m11 * x.x + r.m12 * x.y + r.m13 * x.z + t.x * inverse_depth,
            r.m21 * x.x + r.m22 * x.y + r.m23 * x.z + t.y * inverse_depth,
            r.m31 * x.x + r.m32 * x.y + r.m33 * x.z + t.z * inverse_depth,
        );
        let y = if s.longer == 0.0 { y } else { y + turning.cross(&y) * s.longer };
        if y.z < 1e-6 || flat < 1e-9 {
            continue;
        }
        let iz = 1.0 / y.z;
        let (u, v) = (fx * y.x * iz + cx, fy * y.y * iz + cy);
        let Some([grey, gx, gy]) = reference.sample_with_gradient(u as f32, v as f32) else { continue };
        let residual = f64::from(grey) - (1.0 + state.gain) * s.grey - state.offset;
        absolute.push(residual.abs());
        let w = kernel.weight(residual * residual);
        // ∂grey/∂y (1×3) through the projection
        let (gu, gv) = (f64::from(gx) * fx * iz, f64::from(gy) * fy * iz);
        let by_y = Vector3::new(gu, gv, -(gu * y.x + gv * y.y) * iz);
        // ∂y/∂m = t rayᵀ (1 − c/(mᵀx)²), ∂y/∂ω = −y^ (left perturbation), ∂y/∂c = t/(mᵀx)
        let by_depth = by_y.dot(&t);
        let by_m = s.ray * (by_depth * (1.0 - state.curvature / (flat * flat)));
        let by_turn = y.cross(&by_y);
        let j = [by_m.x, by_m.y, by_m.z, by_turn.x, by_turn.y, by_turn.z, -s.grey, -1.0, by_depth / flat];
        for a in 0..PARAMETERS {
            let wa = w * j[a];
            g[a] += wa * residual;
            for b in a..PARAMETERS {
                h[(a, b)] += wa * j[b];
            }
        }
    }
    h.fill_lower_triangle_with_upper_triangle();
    (h, g)
}

/// Priors, in the units of the data term (grey² · correlated pixels).
pub(super) fn add_priors(
    h: &mut SMatrix<f64, PARAMETERS, PARAMETERS>,
    g: &mut SVector<f64, PARAMETERS>,
    view: &RoadView<'_>,
    state: &State,
    sigma: f64,
    options: &RoadOptions,
) {
    let alignment = &options.advanced.alignment;
    let unit = sigma * sigma * alignment.correlated_pixels;
    let rotation = unit / alignment.rotation_sigma_rad.powi(2);
    for k in 0..3 {
        h[(3 + k, 3 + k)] += rotation;
        g[3 + k] += rotation * state.turn[k];
    }
    // Tilt: the part of m across the guess; the part along it is the scale and stays free.
    let norm = view.guess.norm();
    let axis = view.guess / norm;
    let across = Matrix3::identity() - axis * axis.transpose();
    let tilt = across * (unit / (alignment.tilt_sigma_rad * norm).powi(2));
    let mut block = h.fixed_view_mut::<3, 3>(0, 0);
    block += tilt;
    let mut rhs = g.fixed_rows_mut::<3>(0);
    rhs += tilt * (state.m - view.guess);
    h[(6, 6)] += unit / alignment.gain_variance;
    g[6] += unit / alignment.gain_variance * state.gain;
    h[(7, 7)] += unit / alignment.offset_variance;
    g[7] += unit / alignment.offset_variance * state.offset;
    // c = κ/(2d), κ the curvature and d = 1/|m| the camera's height.
    let curvature = unit / (0.5 * options.curvature_sigma.max(1e-9) * norm * norm).powi(2);
    h[(8, 8)] += curvature;
    g[8] += curvature * state.curvature;
}
