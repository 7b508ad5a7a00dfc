//! A repeating noise texture with a mip pyramid, sampled along the pixel's footprint.

use rayon::prelude::*;

use crate::hash;

/// Texels along a side.
const SIZE: usize = 512;
/// Most samples along the long axis of a footprint.
const TAPS: f32 = 5.0;

/// One period of noise, values about 0 within ±1, every coarser level the mean of the finer.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    levels: Vec<Vec<f32>>,
}

/// The two edges of a pixel's footprint in texture coordinates \[m\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    pub dx: [f32; 2],
    pub dy: [f32; 2],
}

impl Footprint {
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self { dx: self.dx.map(|v| v * factor), dy: self.dy.map(|v| v * factor) }
    }
    /// Extent along the first and second coordinate.
    pub(crate) fn extent(&self) -> [f32; 2] {
        [self.dx[0].abs() + self.dy[0].abs(), self.dx[1].abs() + self.dy[1].abs()]
    }
}

impl Tile {
    /// `weight(cells)` says how strong the octave with so many cells a period is; `shape` bends the sum.
    pub(crate) fn noise(
        seed: u64,
        weight: impl Fn(usize) -> f32 + Sync,
        shape: impl Fn(f32) -> f32 + Sync,
    ) -> Self {
        let octaves: Vec<(usize, f32)> =
            (2..9).map(|o| 1usize << o).map(|cells| (cells, weight(cells))).filter(|o| o.1 != 0.0).collect();
        let total = octaves.iter().map(|o| o.1 * o.1).sum::<f32>().sqrt().max(1e-6);
        let row = |y: usize| {
            (0..SIZE)
                .map(|x| {
                    let octave =
                        |&(cells, w): &(usize, f32)| w * value_noise(seed ^ cells as u64, x, y, cells);
                    shape(octaves.iter().map(octave).sum::<f32>() / total)
                })
                .collect::<Vec<f32>>()
        };
        let finest: Vec<f32> = (0..SIZE).into_par_iter().flat_map_iter(row).collect();
        let mut levels = vec![finest];
        let mut side = SIZE;
        while side > 1 {
            let half = side / 2;
            let fine = &levels[levels.len() - 1];
            let at = |x: usize, y: usize| fine[y * side + x];
            let mean = |i: usize| {
                let (x, y) = (2 * (i % half), 2 * (i / half));
                0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))
            };
            let coarse = (0..half * half).map(mean).collect();
            levels.push(coarse);
            side = half;
        }
        Self { levels }
    }

    /// Mean over a footprint at (u, v) \[m\]; one period is `period_m` long.
    pub(crate) fn sample(&self, u: f32, v: f32, footprint: &Footprint, period_m: f32) -> f32 {
        let scale = SIZE as f32 / period_m;
        let (dx, dy) = (footprint.dx.map(|e| e * scale), footprint.dy.map(|e| e * scale));
        let length = |d: [f32; 2]| (d[0] * d[0] + d[1] * d[1]).sqrt();
        let (long_x, long_y) = (length(dx), length(dy));
        let (axis, long, short) = if long_x > long_y { (dx, long_x, long_y) } else { (dy, long_y, long_x) };
        // A footprint is a parallelogram: its width across the long axis, not its other edge.
        let area = (dx[0] * dy[1] - dx[1] * dy[0]).abs();
        let short = short.min(area / long.max(1e-6)).max(1e-3);
        let taps = -floor(-(long / short.max(1.0)).clamp(1.0, TAPS));
        let level = log2((long / taps).max(short)).max(0.0);
        let (u, v) = (u * scale, v * scale);
        if taps < 2.0 {
            return self.trilinear(u, v, level);
        }
        // Between two levels of the pyramid: each sample takes one of them, as many the upper as its share is.
        let low = (level as usize).min(self.levels.len() - 1);
        let high = (low + 1).min(self.levels.len() - 1);
        let fraction = level - low as f32;
        let mut sum = 0.0;
        for i in 0..taps as usize {
            let place = (i as f32 + 0.5) / taps;
            let t = place - 0.5;
            let chosen = if place < fraction { high } else { low };
            sum += self.bilinear(u + t * axis[0], v + t * axis[1], chosen);
        }
        sum / taps
    }

    fn trilinear(&self, u: f32, v: f32, level: f32) -> f32 {
        let last = self.levels.len() - 1;
        let low = (level as usize).min(last);
        let a = self.bilinear(u, v, low);
        let f = level - low as f32;
        if f <= 0.0 || low == last { a } else { a + (self.bilinear(u, v, low + 1) - a) * f }
    }

    #[inline(always)]
    fn bilinear(&self, u: f32, v: f32, level: usize) -> f32 {
        let texels = self.levels[level].as_slice();
        let side = SIZE >> level;
        let shrink = 1.0 / (1u32 << level) as f32;
        let (u, v) = (u * shrink - 0.5, v * shrink - 0.5);
        let (x, y) = (floor(u), floor(v));
        let (fx, fy) = (u - x, v - y);
        let mask = side - 1;
        let (x0, y0) = (x as i32 as usize & mask, y as i32 as usize & mask);
        let (x1, y1) = ((x0 + 1) & mask, (y0 + 1) & mask);
        // One check of the bounds a row.
        let (Some(upper), Some(lower)) =
            (texels.get(y0 * side..(y0 + 1) * side), texels.get(y1 * side..(y1 + 1) * side))
        else {
            return 0.0;
        };
        let top = upper[x0] + (upper[x1] - upper[x0]) * fx;
        let bottom = lower[x0] + (lower[x1] - lower[x0]) * fx;
        top + (bottom - top) * fy
    }
}

/// `f32::floor` is a function call on the baseline of x86-64; coordinates are far from the limits of an i32.
#[inline(always)]
pub(super) fn floor(x: f32) -> f32 {
    let whole = x as i32 as f32;
    if whole > x { whole - 1.0 } else { whole }
}

/// Logarithm to base 2, linear within octaves: exact where the pyramid's levels are, within 0.09 in between.
fn log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let mantissa = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000);
    ((bits >> 23) as i32 - 127) as f32 + mantissa - 1.0
}

/// Smoothly interpolated random values on a grid of `cells` a period.
fn value_noise(seed: u64, x: usize, y: usize, cells: usize) -> f32 {
    let step = cells as f32 / SIZE as f32;
    let (u, v) = ((x as f32 + 0.5) * step, (y as f32 + 0.5) * step);
    let (i, j) = (u as usize, v as usize);
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (ease(u.fract()), ease(v.fract()));
    let at = |i: usize, j: usize| 2.0 * hash::unit(seed, (i % cells) as i64, (j % cells) as i64) - 1.0;
    let top = at(i, j) + (at(i + 1, j) - at(i, j)) * fx;
    let bottom = at(i, j + 1) + (at(i + 1, j + 1) - at(i, j + 1)) * fx;
    top + (bottom - top) * fy
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_footprint_sees_the_mean_and_a_small_one_the_texel() {
        let tile = Tile::noise(3, |_| 1.0, |v| v);
        let mean = tile.levels[0].iter().sum::<f32>() / (SIZE * SIZE) as f32;
        let wide = Footprint { dx: [600.0, 0.0], dy: [0.0, 600.0] };
        assert!((tile.sample(3.7, 1.1, &wide, 512.0) - mean).abs() < 1e-4);
        let narrow = Footprint { dx: [0.1, 0.0], dy: [0.0, 0.1] };
        assert!((tile.sample(7.5, 4.5, &narrow, 512.0) - tile.levels[0][4 * SIZE + 7]).abs() < 1e-5);
        // One period on is the same place.
        assert!(
            (tile.sample(7.5 - 512.0, 4.5 + 512.0, &narrow, 512.0) - tile.levels[0][4 * SIZE + 7]).abs()
                < 1e-5
        );
    }
}
