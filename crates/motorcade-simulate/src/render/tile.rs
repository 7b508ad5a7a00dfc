//! A repeating noise texture with a mip pyramid, sampled along the pixel's footprint.

use rayon::prelude::*;

use crate::hash;

/// Binary logarithm of the texels along a side.
const BITS: u32 = 9;
/// Texels along a side.
const SIZE: usize = 1 << BITS;
/// Most samples along the long axis of a footprint.
const TAPS: f32 = 5.0;
/// Steps of a byte for a change by 1; the byte 128 stands for 0.
const STEPS: f32 = 127.0;

/// One period of noise, values about 0 within ±1, every coarser level the mean of the finer.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    /// A texel with its right, lower and lower right neighbour, a byte each from the lowest on: one load a sample.
    /// Blocks of 4×4 fill a line of the cache, so that walking either way mostly stays in it. Sides from `SIZE` down to
    /// 4, then the mean alone, as 4 by 4 once more.
    levels: Vec<Vec<u32>>,
}

/// The two edges of a pixel's footprint in texture coordinates \[m\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    pub dx: [f32; 2],
    pub dy: [f32; 2],
}

/// Sampling parameters of a footprint, computed once for all textures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probe {
    /// The longer edge \[m\].
    axis: [f32; 2],
    /// Its length and the width across it \[m\].
    long: f32,
    short: f32,
}

impl Footprint {
    /// Extent along the first and second coordinate.
    pub(crate) fn extent(&self) -> [f32; 2] {
        [self.dx[0].abs() + self.dy[0].abs(), self.dx[1].abs() + self.dy[1].abs()]
    }

    pub(crate) fn probe(&self) -> Probe {
        let squared = |d: [f32; 2]| d[0] * d[0] + d[1] * d[1];
        let (x, y) = (squared(self.dx), squared(self.dy));
        let (axis, long, short) = if x > y { (self.dx, x, y) } else { (self.dy, y, x) };
        let long = long.sqrt().max(1e-9);
        // A footprint is a parallelogram: its width across the long axis, not its other edge.
        let area = (self.dx[0] * self.dy[1] - self.dx[1] * self.dy[0]).abs();
        Probe { axis, long, short: short.sqrt().min(area / long) }
    }
}

impl Probe {
    /// A square of a width.
    pub(crate) fn square(width: f32) -> Self {
        Self { axis: [width, 0.0], long: width, short: width }
    }
    /// In coordinates stretched by a factor.
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self { axis: self.axis.map(|v| v * factor), long: self.long * factor, short: self.short * factor }
    }
    /// With the coordinates exchanged.
    pub(crate) fn swapped(self) -> Self {
        Self { axis: [self.axis[1], self.axis[0]], ..self }
    }
    /// In coordinates (c u + s v, c v - s u).
    pub(crate) fn turned(self, c: f32, s: f32) -> Self {
        let [u, v] = self.axis;
        Self { axis: [c * u + s * v, c * v - s * u], ..self }
    }
}

impl Tile {
    /// `weight(cells)` is the amplitude of the octave with so many cells a period; `shape` maps the sum.
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
        let mut texels: Vec<f32> = (0..SIZE).into_par_iter().flat_map_iter(row).collect();
        let mut levels = vec![packed(&texels, SIZE)];
        let mut side = SIZE;
        while side > 4 {
            let half = side / 2;
            let at = |x: usize, y: usize| texels[y * side + x];
            let mean = |i: usize| {
                let (x, y) = (2 * (i % half), 2 * (i / half));
                0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))
            };
            let coarse: Vec<f32> = (0..half * half).map(mean).collect();
            levels.push(packed(&coarse, half));
            (texels, side) = (coarse, half);
        }
        let mean = texels.iter().sum::<f32>() / texels.len() as f32;
        levels.push(packed(&[mean; 16], 4));
        Self { levels }
    }

    /// Mean over a footprint at (u, v) \[m\]; one period is `period_m` long.
    #[inline(always)]
    pub(crate) fn sample(&self, u: f32, v: f32, probe: &Probe, period_m: f32) -> f32 {
        // Periods are constants: their inverses are, too.
        let frequency = 1.0 / period_m;
        self.mean(u * frequency, v * frequency, probe, frequency)
    }

    /// The same at (u, v) in periods.
    fn mean(&self, u: f32, v: f32, probe: &Probe, frequency: f32) -> f32 {
        /// One over the number of samples.
        const SHARES: [f32; 6] = [1.0, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0];
        let scale = SIZE as f32 * frequency;
        let (long, short) = (probe.long * scale, (probe.short * scale).max(1e-3));
        let wanted = (long / short.max(1.0)).clamp(1.0, TAPS);
        let count = wanted as i32;
        let count = if (count as f32) < wanted { count + 1 } else { count };
        let share = SHARES[count as usize % 6];
        let level = log2((long * share).max(short)).max(0.0);
        let last = self.levels.len() - 1;
        let low = (level as i32 as usize).min(last);
        let high = (low + 1).min(last);
        let fraction = level - low as f32;
        let (u, v) = (phase(u), phase(v));
        let sum = if count < 2 {
            let a = self.walk(low, (u, v), (0, 0), 1) as f32;
            // No share of the coarser level where texels are wider than the footprint.
            if fraction > 0.0 {
                a + (self.walk(high, (u, v), (0, 0), 1) as f32 - a) * fraction.min(1.0)
            } else {
                a
            }
        } else {
            // Between two levels of the pyramid: each sample takes one of them, as many the upper as its share is.
            let upper = ((fraction * count as f32 + 0.5) as i32).clamp(0, count) as u32;
            let count = count as u32;
            let step = frequency * share;
            let (du, dv) = (phase(probe.axis[0] * step), phase(probe.axis[1] * step));
            let half = |step: u32| ((step as i32 / 2) as u32).wrapping_mul(count - 1);
            let (u, v) = (u.wrapping_sub(half(du)), v.wrapping_sub(half(dv)));
            let on = (u.wrapping_add(du.wrapping_mul(upper)), v.wrapping_add(dv.wrapping_mul(upper)));
            let sum = self.walk(high, (u, v), (du, dv), upper) + self.walk(low, on, (du, dv), count - upper);
            sum as f32 * share
        };
        sum * (1.0 / (65536.0 * STEPS)) - 128.0 / STEPS
    }

    /// Sum over `count` places a step apart, of bytes in units of 1/65536 between four texels; 32 bits of phase are a
    /// period.
    #[inline(always)]
    fn walk(&self, level: usize, (u, v): (u32, u32), (du, dv): (u32, u32), count: u32) -> u32 {
        let Some(texels) = self.levels.get(level) else { return 0 };
        let bits = BITS.saturating_sub(level as u32).max(2);
        // The middle of the first texel is half a texel from the edge.
        let half = 1u32 << (31 - bits);
        let (mut u, mut v) = (u.wrapping_sub(half), v.wrapping_sub(half));
        let mut sum = 0;
        for _ in 0..count {
            let (x, y) = (u >> (32 - bits), v >> (32 - bits));
            let (fx, fy) = ((u << bits) >> 24, (v << bits) >> 24);
            let four = texels.get(place(x as usize, y as usize, bits)).copied().unwrap_or(0);
            // Upper and lower pair side by side in the halves of a word.
            let (left, right) = (four & 0x00ff_00ff, (four >> 8) & 0x00ff_00ff);
            let pair = left * (256 - fx) + right * fx;
            sum += (pair & 0xffff) * (256 - fy) + (pair >> 16) * fy;
            (u, v) = (u.wrapping_add(du), v.wrapping_add(dv));
        }
        sum
    }
}

/// Texels with their neighbours.
fn packed(texels: &[f32], side: usize) -> Vec<u32> {
    let byte = |x: usize, y: usize| {
        let value = texels[(y % side) * side + x % side];
        (128.5 + STEPS * value.clamp(-1.0, 1.0)) as u32
    };
    let mut out = vec![0; side * side];
    for (y, x) in (0..side * side).map(|i| (i / side, i % side)) {
        out[place(x, y, side.ilog2())] =
            byte(x, y) | byte(x + 1, y) << 8 | byte(x, y + 1) << 16 | byte(x + 1, y + 1) << 24;
    }
    out
}

/// Index of a texel in blocks of 4×4; `bits` is the binary logarithm of the side.
#[inline(always)]
fn place(x: usize, y: usize, bits: u32) -> usize {
    ((y >> 2) << (bits + 2)) | ((x >> 2) << 4) | ((y & 3) << 2) | (x & 3)
}

/// Share of a period, in 1/2³²; a whole one more is the same.
#[inline(always)]
fn phase(periods: f32) -> u32 {
    // Added to 1.5 · 2⁵², the low bits of a number are those of its integer.
    (f64::from(periods) * 4_294_967_296.0 + 6_755_399_441_055_744.0).to_bits() as u32
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

    /// A texel in the middle of its four.
    fn texel(tile: &Tile, x: usize, y: usize) -> f32 {
        ((tile.levels[0][place(x, y, BITS)] & 255) as f32 - 128.0) / STEPS
    }

    #[test]
    fn a_large_footprint_sees_the_mean_and_a_small_one_the_texel() {
        let tile = Tile::noise(3, |_| 1.0, |v| v);
        let mean =
            (0..SIZE * SIZE).map(|i| texel(&tile, i % SIZE, i / SIZE)).sum::<f32>() / (SIZE * SIZE) as f32;
        let wide = Footprint { dx: [600.0, 0.0], dy: [0.0, 600.0] }.probe();
        // The resolution of a byte is 1/127.
        assert!((tile.sample(3.7, 1.1, &wide, 512.0) - mean).abs() < 5e-3);
        let narrow = Footprint { dx: [0.1, 0.0], dy: [0.0, 0.1] }.probe();
        assert!((tile.sample(7.5, 4.5, &narrow, 512.0) - texel(&tile, 7, 4)).abs() < 1e-5);
        // Periodic.
        assert!((tile.sample(7.5 - 512.0, 4.5 + 512.0, &narrow, 512.0) - texel(&tile, 7, 4)).abs() < 1e-5);
    }

    #[test]
    fn half_way_between_texels_is_their_mean_and_the_wrap_has_no_seam() {
        let tile = Tile::noise(5, |_| 1.0, |v| v);
        let narrow = Probe::square(0.1);
        let at = |u: f32, v: f32| tile.sample(u, v, &narrow, 512.0);
        assert!((at(8.0, 4.5) - 0.5 * (texel(&tile, 7, 4) + texel(&tile, 8, 4))).abs() < 1e-4);
        assert!((at(0.0, 4.5) - 0.5 * (texel(&tile, 511, 4) + texel(&tile, 0, 4))).abs() < 1e-4);
        assert!((at(0.5, 512.0) - 0.5 * (texel(&tile, 0, 511) + texel(&tile, 0, 0))).abs() < 1e-4);
    }

    #[test]
    fn a_long_footprint_is_the_mean_along_it() {
        let tile = Tile::noise(7, |_| 1.0, |v| v);
        let long = Footprint { dx: [5.0, 0.0], dy: [0.0, 1.0] }.probe();
        let mean = (0..5).map(|i| texel(&tile, 40 + i, 9)).sum::<f32>() / 5.0;
        assert!((tile.sample(42.5, 9.5, &long, 512.0) - mean).abs() < 1e-4);
    }
}
