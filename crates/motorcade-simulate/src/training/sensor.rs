//! From irradiance to the grey levels of a random camera: exposure, tone curve, resolution, blur, noise, compression.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::jpeg;
use crate::hash;

type Pixel = [f32; 3];

/// Turns a square of light with `side` pixels a side into bytes. `true_size` is the number of pixels of the camera there: less
/// than `side` means lower resolution.
pub(super) fn expose(light: &[Pixel], side: usize, true_size: (f64, f64), rng: &mut ChaCha8Rng) -> Vec<u8> {
    let size = [true_size.0, true_size.1].map(|s| (s.round() as usize).clamp(8, side));
    let mut image = resampled(light, (side, side), (size[0], size[1]));
    tone(&mut image, rng);
    let (width, height) = (size[0], size[1]);
    if rng.random_bool(0.6) {
        let sigma = rng.random_range(0.25..0.9);
        blur(&mut image, (width, height), sigma, rng.random_bool(0.3));
    }
    if rng.random_bool(0.25) {
        let amount = rng.random_range(0.3..1.2);
        sharpen(&mut image, (width, height), amount);
    }
    let noise = if rng.random_bool(0.7) { rng.random_range(0.5..4.0) } else { rng.random_range(4.0..11.0) };
    let key: u64 = rng.random();
    for (i, pixel) in image.iter_mut().enumerate() {
        let shared = hash::normal(key ^ (4 * i as u64));
        for (k, value) in pixel.iter_mut().enumerate() {
            let own = hash::normal(key ^ (4 * i + k + 1) as u64);
            *value = (*value + noise * (0.8 * shared + 0.5 * own)).clamp(0.0, 255.0);
        }
    }
    if rng.random_bool(0.6) {
        jpeg::degrade(&mut image, (width, height), rng.random_range(25.0..96.0));
    }
    let full = resampled(&image, (width, height), (side, side));
    full.iter().flatten().map(|v| (v + 0.5).clamp(0.0, 255.0) as u8).collect()
}

/// Exposure by the mean, white balance, contrast, gamma; clipped to the range of the sensor.
fn tone(image: &mut [Pixel], rng: &mut ChaCha8Rng) {
    let luma = |p: &Pixel| 0.3 * p[0] + 0.59 * p[1] + 0.11 * p[2];
    let mean = image.iter().map(luma).sum::<f32>() / image.len().max(1) as f32;
    let wanted: f32 = rng.random_range(0.24..0.62);
    // Cameras expose for the whole image, of which the crop is a part.
    let gain = (wanted / mean.max(0.02)).powf(0.7);
    let balance = [rng.random_range(0.92..1.08_f32), 1.0, rng.random_range(0.92..1.08)];
    let contrast: f32 = rng.random_range(0.75..1.5);
    let gamma: f32 = rng.random_range(0.65..1.15);
    let black: f32 = rng.random_range(-0.06..0.03);
    let grey = rng.random_bool(0.12);
    for pixel in image.iter_mut() {
        let mut out: Pixel = std::array::from_fn(|k| {
            let exposed = (gain * balance[k] * pixel[k]).max(0.0).powf(gamma);
            255.0 * ((exposed - 0.4) * contrast + 0.4 - black).clamp(0.0, 1.0)
        });
        if grey {
            out = [luma(&out); 3];
        }
        *pixel = out;
    }
}

/// Resampling: area means when it shrinks, linear between centres when it grows.
fn resampled(image: &[Pixel], (w, h): (usize, usize), (to_w, to_h): (usize, usize)) -> Vec<Pixel> {
    if (w, h) == (to_w, to_h) {
        return image.to_vec();
    }
    let rows: Vec<Vec<(usize, f32)>> = taps(h, to_h);
    let columns: Vec<Vec<(usize, f32)>> = taps(w, to_w);
    let mut narrow = vec![[0.0_f32; 3]; to_w * h];
    for (y, (x, taps)) in (0..h).flat_map(|y| columns.iter().enumerate().map(move |c| (y, c))) {
        for (i, weight) in taps {
            let from = image[y * w + i];
            for k in 0..3 {
                narrow[y * to_w + x][k] += weight * from[k];
            }
        }
    }
    let mut out = vec![[0.0_f32; 3]; to_w * to_h];
    for (y, taps) in rows.iter().enumerate() {
        for (i, weight) in taps {
            for x in 0..to_w {
                let from = narrow[i * to_w + x];
                for k in 0..3 {
                    out[y * to_w + x][k] += weight * from[k];
                }
            }
        }
    }
    out
}

/// Sources and weights of each of `to` samples over `from`.
fn taps(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    let ratio = from as f64 / to as f64;
    (0..to)
        .map(|i| {
            if ratio > 1.0 {
                let (start, end) = (i as f64 * ratio, (i + 1) as f64 * ratio);
                let cover = |j: usize| (end.min((j + 1) as f64) - start.max(j as f64)).max(0.0) / ratio;
                (start as usize..(end.ceil() as usize).min(from)).map(|j| (j, cover(j) as f32)).collect()
            } else {
                let at = ((i as f64 + 0.5) * ratio - 0.5).clamp(0.0, (from - 1) as f64);
                let (j, t) = (at as usize, at.fract() as f32);
                vec![(j, 1.0 - t), ((j + 1).min(from - 1), t)]
            }
        })
        .collect()
}

/// Gaussian blur of three taps; along rows only for motion blur.
fn blur(image: &mut [Pixel], (w, h): (usize, usize), sigma: f32, rows_only: bool) {
    let side = (-0.5 / (sigma * sigma)).exp();
    let (edge, centre) = (side / (1.0 + 2.0 * side), 1.0 / (1.0 + 2.0 * side));
    let mut pass = |step: usize, count: usize, lines: usize, line_step: usize| {
        for line in 0..lines {
            let at = |i: usize| line * line_step + i * step;
            let mut before = image[at(0)];
            for i in 0..count {
                let here = image[at(i)];
                let after = image[at((i + 1).min(count - 1))];
                image[at(i)] = std::array::from_fn(|k| edge * (before[k] + after[k]) + centre * here[k]);
                before = here;
            }
        }
    };
    pass(1, w, h, w);
    if !rows_only {
        pass(w, h, w, 1);
    }
}

/// Unsharp mask, as cameras apply it.
fn sharpen(image: &mut [Pixel], size: (usize, usize), amount: f32) {
    let mut soft = image.to_vec();
    blur(&mut soft, size, 0.8, false);
    for (pixel, soft) in image.iter_mut().zip(&soft) {
        *pixel = std::array::from_fn(|k| pixel[k] + amount * (pixel[k] - soft[k]));
    }
}
