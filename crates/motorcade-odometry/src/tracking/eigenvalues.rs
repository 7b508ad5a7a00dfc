//! Smaller eigenvalue of the structure tensor (Shi and Tomasi, CVPR 1994).

use super::level::PyramidLevel;

/// Smaller eigenvalue of the 7×7 structure tensor at every pixel, mean over the window \[(grey levels/px)²\]; zero near the border.
pub(super) struct EigenvalueMap {
    width: usize,
    values: Vec<f32>,
}

/// Half of the window of the structure tensor \[px\]: 7×7, as in Shi and Tomasi (CVPR 1994).
pub(super) const HALF_WINDOW: usize = 3;

impl EigenvalueMap {
    pub(super) fn new(image: &PyramidLevel) -> Self {
        let (w, h) = (image.width(), image.height());
        let mut values = vec![0.0_f32; w * h];
        let rows = 2 * HALF_WINDOW + 1;
        let mut ring: Vec<[Vec<f32>; 3]> = (0..rows).map(|_| [0; 3].map(|_| vec![0.0; w])).collect();
        let mut sums: [Vec<f32>; 3] = [0; 3].map(|_| vec![0.0; w]);
        let inner = w - 2 * HALF_WINDOW;
        let mut totals: [Vec<f32>; 3] = [0; 3].map(|_| vec![0.0; inner]);
        for y in 0..h {
            gradient_products(image, y, &mut ring[y % rows]);
            if y + 1 < rows {
                continue;
            }
            // Summed for every row: a running sum in f32 would drift.
            for (k, sum) in sums.iter_mut().enumerate() {
                sum.copy_from_slice(&ring[0][k]);
                for row in &ring[1..] {
                    sum.iter_mut().zip(&row[k]).for_each(|(s, v)| *s += v);
                }
            }
            let out = &mut values[(y - HALF_WINDOW) * w..(y - HALF_WINDOW + 1) * w];
            for (sum, total) in sums.iter().zip(&mut totals) {
                // By column of the window: neighbouring pixels are summed by one vector instruction.
                total.copy_from_slice(&sum[..inner]);
                for k in 1..rows {
                    total.iter_mut().zip(&sum[k..]).for_each(|(t, v)| *t += v);
                }
            }
            for (x, out) in out[HALF_WINDOW..HALF_WINDOW + inner].iter_mut().enumerate() {
                let (xx, xy, yy) = (totals[0][x], totals[1][x], totals[2][x]);
                let (half_trace, half_diff) = (0.5 * (xx + yy), 0.5 * (xx - yy));
                *out = (half_trace - (half_diff * half_diff + xy * xy).sqrt()) / (rows * rows) as f32;
            }
        }
        Self { width: w, values }
    }
    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }
    /// True for a local maximum of its 3×3 neighbourhood.
    pub(super) fn is_peak(&self, x: usize, y: usize) -> bool {
        let v = self.at(x, y);
        // Strict on one side: exactly one pixel of a plateau is a peak.
        (y - 1..=y + 1).all(|yy| {
            (x - 1..=x + 1).all(|xx| {
                let other = self.at(xx, yy);
                if (yy, xx) < (y, x) { other < v } else { other <= v }
            })
        })
    }
}

/// Products xx, xy, yy of the gradient along a row; zero on the image border.
fn gradient_products(image: &PyramidLevel, y: usize, out: &mut [Vec<f32>; 3]) {
    let (w, h) = (image.width(), image.height());
    if y == 0 || y + 1 >= h {
        out.iter_mut().for_each(|row| row.fill(0.0));
        return;
    }
    let (up, mid, down) = (image.row(y - 1), image.row(y), image.row(y + 1));
    let [xx, xy, yy] = out;
    for x in 1..w - 1 {
        let (gx, gy) = (0.5 * (mid[x + 1] - mid[x - 1]), 0.5 * (down[x] - up[x]));
        (xx[x], xy[x], yy[x]) = (gx * gx, gx * gy, gy * gy);
    }
}
