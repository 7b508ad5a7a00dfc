//! Square image patches: templates and samples.

use nalgebra::{Matrix2, Point2, Vector2};

use super::level::PyramidLevel;

/// Side of the patch \[px\] on every level; 16 fills two AVX registers a row.
const SIDE: usize = 16;
pub(super) const AREA: usize = SIDE * SIDE;
const HALF: f32 = (SIDE as f32 - 1.0) / 2.0;
/// Side of a template with the border its gradients need \[px\].
const WIDE: usize = SIDE + 2;

/// Template of the inverse compositional update (Baker & Matthews 2004): values, gradients, inverse Hessian.
pub(super) struct Template {
    pub values: [f32; AREA],
    pub dx: [f32; AREA],
    pub dy: [f32; AREA],
    /// xx, xy, yy.
    pub inverse_hessian: [f32; 3],
}

impl Template {
    /// `None` when the patch leaves the image or has too little texture.
    pub fn new(
        image: &PyramidLevel,
        centre: Point2<f32>,
        warp: &Matrix2<f32>,
        least_eigenvalue: f32,
    ) -> Option<Self> {
        let mut wide = [0.0_f32; WIDE * WIDE];
        if warp.m12 == 0.0 && warp.m21 == 0.0 {
            sample_stretched(image, centre, [warp.m11, warp.m22], &mut wide)?;
        } else {
            for r in 0..WIDE {
                for c in 0..WIDE {
                    let offset = warp * Vector2::new(c as f32 - 1.0 - HALF, r as f32 - 1.0 - HALF);
                    wide[r * WIDE + c] = image.sample(centre.x + offset.x, centre.y + offset.y)?;
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

/// Samples a template around `centre` with steps of `stretch` along x and y; the weights of columns and rows are separable.
/// `None` when it leaves the image.
fn sample_stretched(
    image: &PyramidLevel,
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
        *column = along(c, centre.x, stretch[0], image.width())?;
    }
    for (r, line) in out.chunks_exact_mut(WIDE).enumerate() {
        let (y, fy) = along(r, centre.y, stretch[1], image.height())?;
        let (upper, lower) = (image.row(y), image.row(y + 1));
        for ((x, fx), value) in columns.iter().zip(line) {
            let top = upper[*x] + fx * (upper[x + 1] - upper[*x]);
            let bottom = lower[*x] + fx * (lower[x + 1] - lower[*x]);
            *value = top + fy * (bottom - top);
        }
    }
    Some(())
}

/// Samples the unit-step patch around `centre`; false when it leaves the image.
pub(super) fn sample_patch(image: &PyramidLevel, centre: Point2<f32>, out: &mut [f32; AREA]) -> bool {
    let (x, y) = (centre.x - HALF, centre.y - HALF);
    if !(x >= 0.0 && y >= 0.0) {
        return false;
    }
    let (x0, y0) = (x as usize, y as usize);
    if x0 + SIDE + 1 > image.width()
        || y0 + SIDE + 1 > image.height()
        || x0 + SIDE >= image.width()
        || y0 + SIDE >= image.height()
    {
        return false;
    }
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let (w00, w01, w10, w11) = ((1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy);
    for r in 0..SIDE {
        let top = &image.row(y0 + r)[x0..x0 + SIDE + 1];
        let bottom = &image.row(y0 + r + 1)[x0..x0 + SIDE + 1];
        let row = &mut out[r * SIDE..(r + 1) * SIDE];
        for c in 0..SIDE {
            row[c] = w00 * top[c] + w01 * top[c + 1] + w10 * bottom[c] + w11 * bottom[c + 1];
        }
    }
    true
}
