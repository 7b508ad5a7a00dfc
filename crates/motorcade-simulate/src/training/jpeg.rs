//! Compression loss of JPEG: blocks of 8×8 of luma and half-size chroma, quantised in the cosine domain.

use std::f32::consts::PI;

/// Luma quantisation of the standard (ITU T.81, table K.1) at quality 50.
const LUMA: [f32; 64] = [
    16.0, 11.0, 10.0, 16.0, 24.0, 40.0, 51.0, 61.0, 12.0, 12.0, 14.0, 19.0, 26.0, 58.0, 60.0, 55.0, 14.0,
    13.0, 16.0, 24.0, 40.0, 57.0, 69.0, 56.0, 14.0, 17.0, 22.0, 29.0, 51.0, 87.0, 80.0, 62.0, 18.0, 22.0,
    37.0, 56.0, 68.0, 109.0, 103.0, 77.0, 24.0, 35.0, 55.0, 64.0, 81.0, 104.0, 113.0, 92.0, 49.0, 64.0, 78.0,
    87.0, 103.0, 121.0, 120.0, 101.0, 72.0, 92.0, 95.0, 98.0, 112.0, 100.0, 103.0, 99.0,
];

/// Compresses and decompresses an image of grey levels 0–255, three a pixel.
pub(super) fn degrade(image: &mut [[f32; 3]], (width, height): (usize, usize), quality: f32) {
    let scale = if quality < 50.0 { 50.0 / quality } else { 2.0 - quality / 50.0 };
    let basis = basis();
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| Vec::with_capacity(image.len()));
    for [r, g, b] in image.iter() {
        let y = 0.299 * r + 0.587 * g + 0.114 * b;
        planes[0].push(y);
        planes[1].push(0.564 * (b - y));
        planes[2].push(0.713 * (r - y));
    }
    quantise(&mut planes[0], (width, height), scale.max(0.02), &basis);
    for plane in &mut planes[1..] {
        let (w, h) = (width.div_ceil(2), height.div_ceil(2));
        let mut small = vec![0.0; w * h];
        for (i, value) in small.iter_mut().enumerate() {
            let (x, y) = (2 * (i % w), 2 * (i / w));
            let at = |x: usize, y: usize| plane[y.min(height - 1) * width + x.min(width - 1)];
            *value = 0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1));
        }
        quantise(&mut small, (w, h), 1.6 * scale.max(0.02), &basis);
        for (i, value) in plane.iter_mut().enumerate() {
            *value = small[(i / width / 2) * w + (i % width) / 2];
        }
    }
    for (i, pixel) in image.iter_mut().enumerate() {
        let (y, cb, cr) = (planes[0][i], planes[1][i], planes[2][i]);
        let (b, r) = (y + cb / 0.564, y + cr / 0.713);
        *pixel = [r, (y - 0.299 * r - 0.114 * b) / 0.587, b];
    }
}

/// Row k holds the k-th cosine.
fn basis() -> [[f32; 8]; 8] {
    std::array::from_fn(|k| {
        let norm = if k == 0 { (1.0_f32 / 8.0).sqrt() } else { 0.5 };
        std::array::from_fn(|n| norm * ((2 * n + 1) as f32 * k as f32 * PI / 16.0).cos())
    })
}

fn quantise(plane: &mut [f32], (width, height): (usize, usize), scale: f32, basis: &[[f32; 8]; 8]) {
    for (bx, by) in (0..height.div_ceil(8)).flat_map(|by| (0..width.div_ceil(8)).map(move |bx| (bx, by))) {
        let place = |x: usize, y: usize| (8 * by + y).min(height - 1) * width + (8 * bx + x).min(width - 1);
        let block: [[f32; 8]; 8] = std::array::from_fn(|y| std::array::from_fn(|x| plane[place(x, y)]));
        let mut there = product(&product(basis, &block), &transposed(basis));
        for (v, row) in there.iter_mut().enumerate() {
            for (u, value) in row.iter_mut().enumerate() {
                let step = (LUMA[8 * v + u] * scale).max(1.0);
                *value = (*value / step).round() * step;
            }
        }
        let back = product(&product(&transposed(basis), &there), basis);
        for (y, x) in (0..8).flat_map(|y| (0..8).map(move |x| (y, x))) {
            if 8 * by + y < height && 8 * bx + x < width {
                plane[place(x, y)] = back[y][x];
            }
        }
    }
}

fn product(a: &[[f32; 8]; 8], b: &[[f32; 8]; 8]) -> [[f32; 8]; 8] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..8).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &[[f32; 8]; 8]) -> [[f32; 8]; 8] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn high_quality_changes_little_and_low_quality_much() {
        // Grey: half-size chroma would lose detail of colour at any quality.
        let wave = |i: usize| 128.0 + 60.0 * (0.9 * (i % 24) as f32).sin() * (0.7 * (i / 24) as f32).cos();
        let image: Vec<[f32; 3]> = (0..24 * 20).map(|i| [wave(i); 3]).collect();
        let error = |quality| {
            let mut copy = image.clone();
            degrade(&mut copy, (24, 20), quality);
            let off = copy.iter().zip(&image).map(|(a, b)| (a[1] - b[1]).abs()).sum::<f32>();
            off / image.len() as f32
        };
        // A flat image survives any quality.
        let mut flat = vec![[120.0, 130.0, 90.0]; 480];
        degrade(&mut flat, (24, 20), 30.0);
        assert!(flat.iter().all(|p| (p[0] - 120.0).abs() < 8.0));
        assert!(error(98.0) < 2.0 && error(98.0) < 0.5 * error(10.0), "{} {}", error(98.0), error(10.0));
    }
}
