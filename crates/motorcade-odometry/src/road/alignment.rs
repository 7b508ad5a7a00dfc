//! The road plane from pixels: direct alignment of the road between two frames by the homography a plane induces.
//!
//! With the camera motion R, t from the current to the reference frame known up to scale and the road `mᵀX = 1` in the
//! current camera frame (m = −n/d: n the unit normal towards the camera, d the camera's height in the odometry's unit),
//! a road pixel moves by `x' ~ K (R + t mᵀ) K⁻¹ x`. The three numbers of m are found by Gauss–Newton on the grey values
//! of all textured road pixels; the metric scale of the odometry is then `h·|m|`. A small rotation with a prior stands
//! for the error of the odometry's own rotation: 0.02° of pitch moves the road as much as 1 % of scale.

use motorcade_geometry::{
    Camera, PinholeCamera, Pose,
    lie::so3,
    robust::{Kernel, sigma_from_absolute},
};
use nalgebra::{Matrix3, Matrix4, Point2, SMatrix, SVector, Vector3};

use super::pixels::RoadPixels;
use crate::tracking::Pyramid;

/// How the road is aligned. Lengths are in camera heights, so that nothing depends on the unknown unit.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RoadOptions {
    /// Far end of the stretch of road used \[camera heights\]; 15 heights are 25 m for a car.
    pub far_heights: f64,
    /// Half width of that stretch where a road mask keeps verges out \[camera heights\]: 1.7 heights are 2.8 m, the own
    /// lane, which is one plane far more often than the whole carriageway with its crown and kerbs.
    pub half_width_heights: f64,
    /// Half width where no mask is given \[camera heights\]: 0.7 heights are 1.15 m, what the car itself will drive over;
    /// kerbs and verges beyond pass for a road that is tipped, and too low.
    pub unmasked_half_width_heights: f64,
    /// Half width to which that stretch grows while alignments fail or find little texture \[camera heights\]: small pictures,
    /// smooth asphalt.
    pub unmasked_widest_heights: f64,
    /// Pixels below which it grows, and above twice of which it shrinks again.
    pub unmasked_pixels: usize,
    /// Least motion between the two frames \[camera heights\].
    pub baseline_heights: f64,
    /// Oldest frame a current one is compared with \[frames\].
    pub oldest_frames: usize,
    /// Standard deviation of the odometry's rotation between the two frames \[rad\].
    pub rotation_sigma_rad: f64,
    /// Standard deviation of pitch and roll about the expected plane \[rad\].
    pub tilt_sigma_rad: f64,
    /// Standard deviation of the road's vertical curvature times the camera's height: 0.0005 is a radius of 3300 m, what
    /// streets have on the level. Hilly drives are better served by 0.002, the foot of a hill of 800 m radius
    /// under a car's camera; but then the crown of a flat street passes for height. Zero takes the road as a plane.
    pub curvature_sigma: f64,
    /// True compares only what was road in the earlier picture, too; false lets vehicles there pass for road.
    pub both_pictures: bool,
    /// Pixels with a smaller gradient carry no information \[grey levels/px\].
    pub least_gradient: f32,
    /// Pixels used at most on a level.
    pub most_pixels: usize,
    /// Pixels needed.
    pub least_pixels: usize,
    /// Share of the pixels that must agree with the plane.
    pub least_agreement: f64,
    /// Iterations on each level.
    pub iterations: usize,
    /// False holds the normal at (0, −1, 0), a level road and a camera looking along it, as the paper does.
    pub free_normal: bool,
}

impl Default for RoadOptions {
    fn default() -> Self {
        Self {
            far_heights: 15.0,
            half_width_heights: 1.7,
            unmasked_half_width_heights: 0.7,
            unmasked_widest_heights: 1.0,
            unmasked_pixels: 2500,
            baseline_heights: 1.2,
            oldest_frames: 15,
            rotation_sigma_rad: 0.02_f64.to_radians(),
            tilt_sigma_rad: 1.5_f64.to_radians(),
            curvature_sigma: 0.001,
            both_pictures: true,
            least_gradient: 2.0,
            most_pixels: 8000,
            least_pixels: 300,
            least_agreement: 0.5,
            iterations: 8,
            free_normal: true,
        }
    }
}

/// The road plane in the current camera frame, in the odometry's unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadPlane {
    /// m with `mᵀX = 1` for points X on the road (3).
    pub m: Vector3<f64>,
    /// Vertical curvature over twice the camera's height, c in `1/z = mᵀx + c/(mᵀx)`.
    pub curvature: f64,
    /// Covariance of m and curvature (4×4).
    pub covariance: Matrix4<f64>,
    /// Standard deviation of curvature times height that was assumed.
    pub assumed_curvature_sigma: f64,
    /// Pixels used.
    pub pixels: usize,
    /// Share of them that agree.
    pub agreement: f64,
    /// Standard deviation of the grey residual.
    pub sigma_grey: f64,
}

/// Neighbouring pixels share interpolation, texture and noise: about this many count as one measurement.
const CORRELATED_PIXELS: f64 = 8.0;

struct Sample {
    ray: Vector3<f64>,
    grey: f64,
}

/// Memory of one alignment, kept for the next.
#[derive(Default)]
pub struct RoadScratch {
    samples: Vec<Sample>,
    /// Absolute grey residuals.
    absolute: Vec<f64>,
}

/// The stretch of road to look at and its present guess.
#[derive(Clone, Copy)]
pub struct RoadView<'a> {
    /// Intrinsics of level 0.
    pub camera: &'a PinholeCamera,
    /// Current image.
    pub current: &'a Pyramid,
    /// Earlier image.
    pub reference: &'a Pyramid,
    /// Camera motion, odometry's unit.
    pub reference_from_current: Pose<Camera, Camera>,
    /// Guess of m.
    pub guess: Vector3<f64>,
    /// Where the reference showed road: not where a vehicle stood in the way, or cast its shadow.
    pub road_in_reference: &'a RoadPixels,
}

impl RoadView<'_> {
    /// Puts into `out` the road pixels of a level: inside the stretch, allowed, textured; thinned evenly when there are too
    /// many.
    fn samples(
        &self,
        level: usize,
        usable: &impl Fn(&Point2<f64>) -> bool,
        options: &RoadOptions,
        out: &mut Vec<Sample>,
    ) {
        let plane = self.current.level(level);
        let scale = f64::from(1u32 << level);
        let height = 1.0 / self.guess.norm();
        let (far, half_width) = (options.far_heights * height, options.half_width_heights * height);
        out.clear();
        let least = options.least_gradient * options.least_gradient;
        for y in 2..plane.height().saturating_sub(3) {
            let v = y as f64 * scale;
            let (up, row, down) = (plane.row(y - 1), plane.row(y), plane.row(y + 1));
            for x in self.stretch(v, scale, plane.width(), far, half_width) {
                let gx = 0.5 * (row[x + 1] - row[x - 1]);
                let gy = 0.5 * (down[x] - up[x]);
                if gx * gx + gy * gy < least {
                    continue;
                }
                let pixel = Point2::new(x as f64 * scale, v);
                let ray = self.camera.ray(&pixel);
                if usable(&pixel) && self.seen_before(&ray) {
                    out.push(Sample { ray, grey: f64::from(row[x]) });
                }
            }
        }
        let keep_every = out.len().div_ceil(options.most_pixels.max(1)).max(1);
        if keep_every > 1 {
            let mut index = 0;
            out.retain(|_| {
                index += 1;
                index % keep_every == 0
            });
        }
    }

    /// Whether the reference, too, shows road there; by the guess of the plane.
    fn seen_before(&self, ray: &Vector3<f64>) -> bool {
        let motion = &self.reference_from_current;
        let there = motion.transform_vector(ray) + motion.translation() * self.guess.dot(ray);
        let pixel = (there.z > 1e-6).then(|| self.camera.project(&(there / there.z).into())).flatten();
        pixel.is_none_or(|p| self.road_in_reference.holds(&p))
    }

    /// Columns of a row of pixels (level 0: `v`) that see the stretch: nearer than `far`, within `half_width` of the camera.
    /// Depth and place are linear in the column over a common denominator, so the columns are one run.
    fn stretch(&self, v: f64, scale: f64, width: usize, far: f64, half_width: f64) -> std::ops::Range<usize> {
        let ray = self.camera.ray(&Point2::new(0.0, v));
        let step = scale / self.camera.fx;
        // Inverse depth a + b x must exceed 1/far; |X| ≤ half width is ±(c + d x) ≤ half width (a + b x).
        let (a, b) = (self.guess.dot(&ray), self.guess.x * step);
        let (c, d) = (ray.x, step);
        let (mut low, mut high) = (2.0, width.saturating_sub(3) as f64);
        for (offset, slope) in [
            (a - 1.0 / far, b),
            (half_width * a - c, half_width * b - d),
            (half_width * a + c, half_width * b + d),
        ] {
            // offset + slope x ≥ 0
            if slope.abs() < 1e-15 {
                if offset < 0.0 {
                    high = low;
                }
            } else if slope > 0.0 {
                low = low.max(-offset / slope);
            } else {
                high = high.min((-offset / slope).floor() + 1.0);
            }
        }
        let (low, high) = (low.ceil().max(0.0) as usize, high.max(0.0) as usize);
        low..high.max(low)
    }

    /// Robust mean absolute grey difference of a plane, for the first coarse search; `None` when too little overlaps.
    fn mismatch(&self, m: &Vector3<f64>, samples: &[Sample], level: usize) -> Option<f64> {
        let r = self.reference_from_current.rotation_matrix();
        let t = self.reference_from_current.translation();
        let plane = self.reference.level(level);
        let scale = 1.0 / f64::from(1u32 << level);
        let (mut sum, mut count) = (0.0, 0);
        for s in samples {
            let moved = r * s.ray + t * m.dot(&s.ray);
            let pixel = (moved.z > 1e-6).then(|| self.camera.project(&(moved / moved.z).into())).flatten();
            let grey = pixel.and_then(|p| plane.sample((p.x * scale) as f32, (p.y * scale) as f32));
            if let Some(grey) = grey {
                sum += (f64::from(grey) - s.grey).abs().min(40.0);
                count += 1;
            }
        }
        (2 * count > samples.len()).then(|| sum / count as f64)
    }
}

/// Searches the scale of the plane from a quarter of the guess to sixteen times; for the first frames of a segment, when
/// nothing is known of the odometry's unit. Fast drives and few frames a second show no near points: the unit is then ten
/// metres, and the camera a fifth of it high. Returns the best m.
pub fn search_scale(
    view: &RoadView<'_>,
    usable: impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<Vector3<f64>> {
    const STEPS: i32 = 40;
    let level = 2.min(view.current.len() - 1);
    let samples = &mut scratch.samples;
    view.samples(level, &usable, options, samples);
    if samples.len() < options.least_pixels / 4 {
        return None;
    }
    let plane = |k: i32| view.guess * 4.0_f64.powf(f64::from(k) / f64::from(STEPS));
    let scores: Vec<(f64, Vector3<f64>)> = (-STEPS..=2 * STEPS)
        .map(|k| (view.mismatch(&plane(k), samples, level).unwrap_or(f64::MAX), plane(k)))
        .collect();
    let best = (0..scores.len()).min_by(|a, b| scores[*a].0.total_cmp(&scores[*b].0))?;
    // At the ends of the range nothing says that a minimum is one: a wet road that mirrors the sky stays where it is in the
    // picture, as a plane far below would.
    (best > 0 && best + 1 < scores.len() && scores[best].0 < f64::MAX).then(|| scores[best].1)
}

/// Aligns the road. `None` when there is too little texture or the plane does not explain it.
pub fn align_road(
    view: &RoadView<'_>,
    usable: impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<RoadPlane> {
    if !options.free_normal {
        return align_level_road(view, &usable, options, scratch);
    }
    align(view, &usable, options, scratch)
}

/// With the normal held: the guess is turned level and its tilt gets no room.
fn align_level_road(
    view: &RoadView<'_>,
    usable: &impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<RoadPlane> {
    const NO_ROOM_RAD: f64 = 1e-5;
    let level = RoadView { guess: Vector3::new(0.0, view.guess.norm(), 0.0), ..*view };
    let options = RoadOptions { tilt_sigma_rad: NO_ROOM_RAD, ..*options };
    align(&level, usable, &options, scratch)
}

fn align(
    view: &RoadView<'_>,
    usable: &impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<RoadPlane> {
    let mut state = State { m: view.guess, turn: Vector3::zeros(), gain: 0.0, bias: 0.0, curvature: 0.0 };
    let mut result = None;
    for level in (0..2.min(view.current.len())).rev() {
        view.samples(level, usable, options, &mut scratch.samples);
        if scratch.samples.len() < options.least_pixels {
            return None;
        }
        result = refine(view, scratch, level, &mut state, options);
        result.as_ref()?;
    }
    result
}

struct State {
    m: Vector3<f64>,
    turn: Vector3<f64>,
    gain: f64,
    bias: f64,
    /// Vertical curvature of the road over twice the camera's height, c in `1/z = mᵀx + c/(mᵀx)`: foot and crest of a hill.
    curvature: f64,
}

/// m (3), small rotation (3), gain and bias of the grey values (2), curvature (1).
const PARAMETERS: usize = 9;
/// Those that are told: m and curvature.
const KEPT: [usize; 4] = [0, 1, 2, 8];
type Normal = (SMatrix<f64, PARAMETERS, PARAMETERS>, SVector<f64, PARAMETERS>);

fn refine(
    view: &RoadView<'_>,
    RoadScratch { samples, absolute }: &mut RoadScratch,
    level: usize,
    state: &mut State,
    options: &RoadOptions,
) -> Option<RoadPlane> {
    // Residual noise to begin with [grey levels]; measured anew after every pass.
    let mut sigma = 8.0;
    let mut last = None;
    for _ in 0..options.iterations {
        let (mut h, mut g) = accumulate(view, samples, level, state, sigma, absolute);
        let seen = absolute.len();
        if seen < options.least_pixels {
            return None;
        }
        add_priors(&mut h, &mut g, view, state, sigma, options);
        let step = h.cholesky()?.solve(&-g);
        state.m += step.fixed_rows::<3>(0);
        state.turn += step.fixed_rows::<3>(3);
        state.gain += step[6];
        state.bias += step[7];
        state.curvature += step[8];
        let agreement =
            absolute.iter().filter(|r| **r < 2.5 * sigma.max(2.0)).count() as f64 / samples.len() as f64;
        sigma = sigma_from_absolute(absolute)?.max(0.5);
        let whole = h.try_inverse()? * (sigma * sigma * CORRELATED_PIXELS);
        let plane = RoadPlane {
            m: state.m,
            curvature: state.curvature,
            covariance: Matrix4::from_fn(|r, c| whole[(KEPT[r], KEPT[c])]),
            assumed_curvature_sigma: options.curvature_sigma,
            pixels: seen,
            agreement,
            sigma_grey: sigma,
        };
        let settled = step.fixed_rows::<3>(0).norm() < 1e-5 * state.m.norm();
        last = Some(plane);
        if settled {
            break;
        }
    }
    // A plane above the camera, behind it or far off the guess is not the road.
    let sane =
        state.m.iter().all(|v| v.is_finite()) && state.m.angle(&view.guess) < 6.0 * options.tilt_sigma_rad;
    last.filter(|p| sane && p.agreement >= options.least_agreement)
}

/// Normal equations; puts the absolute residuals into `absolute`.
fn accumulate(
    view: &RoadView<'_>,
    samples: &[Sample],
    level: usize,
    state: &State,
    sigma: f64,
    absolute: &mut Vec<f64>,
) -> Normal {
    let reference = view.reference.level(level);
    let scale = 1.0 / f64::from(1u32 << level);
    let turn = so3::exp(&state.turn).to_rotation_matrix().into_inner();
    let r = turn * view.reference_from_current.rotation_matrix();
    let t = turn * view.reference_from_current.translation();
    let kernel = Kernel::Cauchy(2.0 * sigma);
    let (fx, fy) = (view.camera.fx * scale, view.camera.fy * scale);
    let (cx, cy) = (view.camera.cx * scale, view.camera.cy * scale);
    let (mut h, mut g): Normal = (SMatrix::zeros(), SVector::zeros());
    absolute.clear();
    absolute.reserve(samples.len());
    for s in samples {
        let flat = state.m.dot(&s.ray);
        let x = &s.ray;
        let lift = flat + state.curvature / flat;
        let y = Vector3::new(
            r.m11 * x.x + r.m12 * x.y + r.m13 * x.z + t.x * lift,
            r.m21 * x.x + r.m22 * x.y + r.m23 * x.z + t.y * lift,
            r.m31 * x.x + r.m32 * x.y + r.m33 * x.z + t.z * lift,
        );
        if y.z < 1e-6 || flat < 1e-9 {
            continue;
        }
        let iz = 1.0 / y.z;
        let (u, v) = (fx * y.x * iz + cx, fy * y.y * iz + cy);
        let Some([grey, gx, gy]) = reference.sample_with_gradient(u as f32, v as f32) else { continue };
        let residual = f64::from(grey) - (1.0 + state.gain) * s.grey - state.bias;
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
fn add_priors(
    h: &mut SMatrix<f64, PARAMETERS, PARAMETERS>,
    g: &mut SVector<f64, PARAMETERS>,
    view: &RoadView<'_>,
    state: &State,
    sigma: f64,
    options: &RoadOptions,
) {
    let unit = sigma * sigma * CORRELATED_PIXELS;
    let rotation = unit / options.rotation_sigma_rad.powi(2);
    for k in 0..3 {
        h[(3 + k, 3 + k)] += rotation;
        g[3 + k] += rotation * state.turn[k];
    }
    // Tilt: the part of m across the guess; the part along it is the scale and stays free.
    let norm = view.guess.norm();
    let axis = view.guess / norm;
    let across = Matrix3::identity() - axis * axis.transpose();
    let tilt = across * (unit / (options.tilt_sigma_rad * norm).powi(2));
    let mut block = h.fixed_view_mut::<3, 3>(0, 0);
    block += tilt;
    let mut rhs = g.fixed_rows_mut::<3>(0);
    rhs += tilt * (state.m - view.guess);
    // Gain ±10 %, bias ±10 grey levels.
    h[(6, 6)] += unit / 0.01;
    g[6] += unit / 0.01 * state.gain;
    h[(7, 7)] += unit / 100.0;
    g[7] += unit / 100.0 * state.bias;
    // c = κ/(2d), κ the curvature and d = 1/|m| the camera's height.
    let curvature = unit / (0.5 * options.curvature_sigma.max(1e-9) * norm * norm).powi(2);
    h[(8, 8)] += curvature;
    g[8] += curvature * state.curvature;
}
