//! Pyramidal Lucas–Kanade tracking of small patches (Baker & Matthews 2004, inverse compositional, translation only)
//! with a known affine pre-warp: the template is resampled as the patch is expected to look in the new image, which
//! takes the 10–20 % growth of near points per frame out of the residual.

use nalgebra::{Matrix2, Point2, Vector2};

use super::pyramid::{Plane, Pyramid};

/// Side of the patch \[px\] on every level; 16 fills two AVX registers a row.
const SIDE: usize = 16;
const AREA: usize = SIDE * SIDE;
const HALF: f32 = (SIDE as f32 - 1.0) / 2.0;
/// Side of a template with the rim its gradients need \[px\].
const WIDE: usize = SIDE + 2;

/// Limits of the tracker.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct KltOptions {
    /// Iterations on each level.
    pub max_iterations: usize,
    /// Steps shorter than this end the iteration \[px\].
    pub epsilon_px: f32,
    /// Largest root-mean-square grey difference of an accepted patch, after removing the mean.
    pub max_rms: f32,
    /// Least smaller eigenvalue of the template's structure tensor, mean over the patch \[(grey levels/px)²\].
    pub least_eigenvalue: f32,
    /// Largest forward–backward distance \[px\].
    pub max_return_px: f64,
}

impl Default for KltOptions {
    fn default() -> Self {
        Self {
            max_iterations: 12,
            epsilon_px: 0.01,
            max_rms: 18.0,
            least_eigenvalue: 3.0,
            max_return_px: 0.7,
        }
    }
}

/// A patch to follow from one image to another.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// Where it is in the first image \[px\].
    pub from: Point2<f64>,
    /// Where it is expected in the second \[px\].
    pub expected: Point2<f64>,
    /// Local affine map of offsets from the second image to the first (2×2); identity when nothing is known.
    pub from_offset: Matrix2<f64>,
    /// Coarsest level to start on.
    pub top_level: usize,
}

struct Template {
    values: [f32; AREA],
    dx: [f32; AREA],
    dy: [f32; AREA],
    inverse_hessian: [f32; 3],
}

impl Template {
    fn new(plane: &Plane, centre: Point2<f32>, warp: &Matrix2<f32>, least_eigenvalue: f32) -> Option<Self> {
        let mut wide = [0.0_f32; WIDE * WIDE];
        if warp.m12 == 0.0 && warp.m21 == 0.0 {
            sample_stretched(plane, centre, [warp.m11, warp.m22], &mut wide)?;
        } else {
            for r in 0..WIDE {
                for c in 0..WIDE {
                    let offset = warp * Vector2::new(c as f32 - 1.0 - HALF, r as f32 - 1.0 - HALF);
                    wide[r * WIDE + c] = plane.sample(centre.x + offset.x, centre.y + offset.y)?;
                }
            }
        }
        let mut out =
            Self { values: [0.0; AREA], dx: [0.0; AREA], dy: [0.0; AREA], inverse_hessian: [0.0; 3] };
        let (mut sum, mut gx_sum, mut gy_sum) = (0.0, 0.0, 0.0);
        for r in 0..SIDE {
            for c in 0..SIDE {
                let i = (r + 1) * WIDE + c + 1;
                let k = r * SIDE + c;
                out.values[k] = wide[i];
                out.dx[k] = 0.5 * (wide[i + 1] - wide[i - 1]);
                out.dy[k] = 0.5 * (wide[i + WIDE] - wide[i - WIDE]);
                sum += wide[i];
                gx_sum += out.dx[k];
                gy_sum += out.dy[k];
            }
        }
        let n = AREA as f32;
        // With the patch mean free (exposure may change), gradients count relative to their mean too.
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for k in 0..AREA {
            out.values[k] -= sum / n;
            out.dx[k] -= gx_sum / n;
            out.dy[k] -= gy_sum / n;
            xx += out.dx[k] * out.dx[k];
            xy += out.dx[k] * out.dy[k];
            yy += out.dy[k] * out.dy[k];
        }
        let smaller = 0.5 * (xx + yy) - (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        if smaller < least_eigenvalue * n {
            return None;
        }
        let determinant = xx * yy - xy * xy;
        out.inverse_hessian = [yy / determinant, -xy / determinant, xx / determinant];
        Some(out)
    }
}

/// Samples a template around `centre` with steps of `stretch` along x and y: columns share their place between pixels, rows
/// too. `None` when it leaves the image.
fn sample_stretched(
    plane: &Plane,
    centre: Point2<f32>,
    stretch: [f32; 2],
    out: &mut [f32; WIDE * WIDE],
) -> Option<()> {
    let along = |k: usize, middle: f32, stretch: f32, size: usize| {
        let at = middle + stretch * (k as f32 - 1.0 - HALF);
        (at >= 0.0 && (at as usize) + 1 < size).then_some((at as usize, at - (at as usize) as f32))
    };
    let mut columns = [(0, 0.0); WIDE];
    for (c, column) in columns.iter_mut().enumerate() {
        *column = along(c, centre.x, stretch[0], plane.width())?;
    }
    for (r, line) in out.chunks_exact_mut(WIDE).enumerate() {
        let (y, fy) = along(r, centre.y, stretch[1], plane.height())?;
        let (upper, lower) = (plane.row(y), plane.row(y + 1));
        for ((x, fx), value) in columns.iter().zip(line) {
            let top = upper[*x] + fx * (upper[x + 1] - upper[*x]);
            let bottom = lower[*x] + fx * (lower[x + 1] - lower[*x]);
            *value = top + fy * (bottom - top);
        }
    }
    Some(())
}

/// Samples the unit-step patch around `centre`; false when it leaves the image.
fn sample_patch(plane: &Plane, centre: Point2<f32>, out: &mut [f32; AREA]) -> bool {
    let (x, y) = (centre.x - HALF, centre.y - HALF);
    if !(x >= 0.0 && y >= 0.0) {
        return false;
    }
    let (x0, y0) = (x as usize, y as usize);
    if x0 + SIDE + 1 > plane.width()
        || y0 + SIDE + 1 > plane.height()
        || x0 + SIDE >= plane.width()
        || y0 + SIDE >= plane.height()
    {
        return false;
    }
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let (w00, w01, w10, w11) = ((1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy);
    for r in 0..SIDE {
        let top = &plane.row(y0 + r)[x0..x0 + SIDE + 1];
        let bottom = &plane.row(y0 + r + 1)[x0..x0 + SIDE + 1];
        let row = &mut out[r * SIDE..(r + 1) * SIDE];
        for c in 0..SIDE {
            row[c] = w00 * top[c] + w01 * top[c + 1] + w10 * bottom[c] + w11 * bottom[c + 1];
        }
    }
    true
}

fn iterate(
    template: &Template,
    plane: &Plane,
    mut at: Point2<f32>,
    options: &KltOptions,
    patch: &mut [f32; AREA],
) -> Option<(Point2<f32>, f32)> {
    let mut rms = f32::MAX;
    for _ in 0..options.max_iterations {
        if !sample_patch(plane, at, patch) {
            return None;
        }
        // Eight running sums a term: the compiler keeps them in registers, and their order is fixed.
        let mut mean = [0.0_f32; 8];
        for chunk in patch.chunks_exact(8) {
            for k in 0..8 {
                mean[k] += chunk[k];
            }
        }
        let mean = mean.iter().sum::<f32>() / AREA as f32;
        let (mut bx, mut by, mut ss) = ([0.0_f32; 8], [0.0_f32; 8], [0.0_f32; 8]);
        for i in (0..AREA).step_by(8) {
            for k in 0..8 {
                let r = patch[i + k] - mean - template.values[i + k];
                bx[k] += r * template.dx[i + k];
                by[k] += r * template.dy[i + k];
                ss[k] += r * r;
            }
        }
        let (bx, by, ss): (f32, f32, f32) = (bx.iter().sum(), by.iter().sum(), ss.iter().sum());
        let [ixx, ixy, iyy] = template.inverse_hessian;
        let step = Vector2::new(ixx * bx + ixy * by, ixy * bx + iyy * by);
        rms = (ss / AREA as f32).sqrt();
        at -= step;
        if !(at.x.is_finite() && at.y.is_finite()) {
            return None;
        }
        if step.norm() < options.epsilon_px {
            break;
        }
    }
    Some((at, rms))
}

/// Follows one patch from `from` to `to`. `None` when it leaves the image, has no texture or looks different.
pub fn track(from: &Pyramid, to: &Pyramid, request: &Request, options: &KltOptions) -> Option<Point2<f64>> {
    let warp: Matrix2<f32> = request.from_offset.cast();
    let mut at: Point2<f32> = request.expected.cast();
    let mut patch = [0.0; AREA];
    let mut rms = f32::MAX;
    for level in (0..=request.top_level.min(to.len() - 1)).rev() {
        let scale = 1.0 / (1 << level) as f32;
        let centre: Point2<f32> = Point2::from(request.from.coords.cast::<f32>() * scale);
        // A coarse level without texture, or too near the border, has nothing to add; the finest one must succeed.
        let template = Template::new(from.level(level), centre, &warp, options.least_eigenvalue);
        let found = template
            .and_then(|t| iterate(&t, to.level(level), Point2::from(at.coords * scale), options, &mut patch));
        match found {
            Some((p, r)) => {
                at = Point2::from(p.coords / scale);
                rms = r;
            }
            None if level > 0 => {}
            None => return None,
        }
    }
    (rms <= options.max_rms).then(|| at.cast())
}

/// [`track`] there and back. The way back starts as far off as the way there did: starting it at the true point would
/// agree with itself on any weak texture.
pub fn track_checked(
    from: &Pyramid,
    to: &Pyramid,
    request: &Request,
    options: &KltOptions,
) -> Option<Point2<f64>> {
    let there = track(from, to, request, options)?;
    let back = Request {
        from: there,
        expected: request.from + (request.expected - there),
        from_offset: request.from_offset.try_inverse()?,
        // A start within the patch's reach needs no pyramid.
        top_level: request.top_level.min(if (request.expected - there).norm() < 4.0 { 1 } else { 3 }),
    };
    let returned = track(to, from, &back, options)?;
    ((returned - request.from).norm() <= options.max_return_px).then_some(there)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};

    /// Smooth aperiodic texture.
    fn texture(x: f64, y: f64) -> f64 {
        128.0
            + 40.0 * (0.31 * x + 0.11 * y).sin()
            + 35.0 * (0.23 * y - 0.17 * x).cos()
            + 30.0 * (0.05 * x * 0.9 + 0.37 * y).sin()
    }

    fn render(map: impl Fn(f64, f64) -> (f64, f64)) -> Pyramid {
        let image = GrayImage::from_fn(240, 160, |x, y| {
            let (u, v) = map(f64::from(x), f64::from(y));
            Luma([texture(u, v).round().clamp(0.0, 255.0) as u8])
        });
        Pyramid::new(&image, 4)
    }

    #[test]
    fn follows_a_shift_to_sub_pixel() {
        let (a, b) = (render(|x, y| (x, y)), render(|x, y| (x - 7.3, y + 3.7)));
        let from = Point2::new(100.0, 80.0);
        let request = Request { from, expected: from, from_offset: Matrix2::identity(), top_level: 3 };
        let found = track_checked(&a, &b, &request, &KltOptions::default()).unwrap();
        assert!((found - Point2::new(107.3, 76.3)).norm() < 0.03, "{found}");
    }

    #[test]
    fn growth_is_taken_out_by_the_warp() {
        let centre = (120.0, 80.0);
        let zoom = |x: f64, y: f64| (centre.0 + (x - centre.0) / 1.2, centre.1 + (y - centre.1) / 1.2);
        let (a, b) = (render(|x, y| (x, y)), render(zoom));
        let from = Point2::new(150.0, 95.0);
        let truth = Point2::new(156.0, 98.0);
        let request = Request { from, expected: from, from_offset: Matrix2::identity() / 1.2, top_level: 2 };
        let found = track(&a, &b, &request, &KltOptions::default()).unwrap();
        assert!((found - truth).norm() < 0.05, "{found}");
    }

    #[test]
    fn leaving_the_image_and_flat_patches_are_refused() {
        let a = render(|x, y| (x, y));
        let flat = Pyramid::new(&GrayImage::from_pixel(240, 160, Luma([90])), 4);
        let request = Request {
            from: Point2::new(100.0, 80.0),
            expected: Point2::new(500.0, 80.0),
            from_offset: Matrix2::identity(),
            top_level: 0,
        };
        assert!(track(&a, &a, &request, &KltOptions::default()).is_none());
        let still = Request { expected: request.from, ..request };
        assert!(track(&flat, &a, &still, &KltOptions::default()).is_none());
    }
}
