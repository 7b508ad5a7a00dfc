//! From irradiance to grey levels.

use image::RgbImage;
use rayon::prelude::*;

use super::colour::Colour;
use super::rain;
use crate::hash;
use crate::options::RenderOptions;
use crate::weather::Weather;

/// Exposure, noise and rounding of one frame, whose gain is `exposure` times the usual one; the same for any thread count.
pub(super) fn expose(
    light: &[Colour],
    options: &RenderOptions,
    exposure: f32,
    seed: u64,
    frame: usize,
) -> RgbImage {
    let (width, height) = (options.camera.width, options.camera.height);
    let time_s = frame as f64 / options.fps;
    let drift = (0.7 * time_s).sin() + 0.5 * (0.23 * time_s + 1.0).sin();
    let gain = 255.0 * exposure * (1.0 + options.sensor.exposure_drift * drift) as f32;
    // Shot noise grows with the root of the gain.
    let noise = options.sensor.noise as f32 * options.weather.noise() * exposure.sqrt();
    let key = hash::mix(seed ^ hash::mix(frame as u64));
    let mut image = RgbImage::new(width, height);
    let rows = image.par_chunks_mut(3 * width as usize).zip(light.par_chunks(width as usize)).enumerate();
    rows.for_each(|(y, (to, from))| {
        let rain = options.weather == Weather::Rain;
        let mut line;
        let from = if rain {
            line = from.to_vec();
            rain::over_row(&mut line, light, (width, height), y, (seed, frame, time_s));
            line.as_slice()
        } else {
            from
        };
        for (x, (to, colour)) in to.chunks_exact_mut(3).zip(from).enumerate() {
            let place = (y as u64 * u64::from(width) + x as u64) * 2;
            // Most of a pixel's noise is common to its colours, as after demosaicking.
            let shared = if noise > 0.0 { noise * hash::normal(key ^ place) } else { 0.0 };
            // The cast clamps to 0 and 255; adding a half rounds.
            for (to, c) in to.iter_mut().zip(colour) {
                *to = (gain * c + shared + 0.5) as u8;
            }
        }
    });
    image
}
