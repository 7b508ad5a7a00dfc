//! Rain between the scene and the sensor: streaks in the air, drops on the lens.

use super::colour::{Colour, mixed};
use crate::hash;

/// Number of streaks in a picture of KITTI's size; the density is the same in any other.
const STREAKS: i64 = 140;
/// Number of drops on the lens.
const DROPS: i64 = 9;
/// Time for which a drop stays \[s\].
const DROP_S: f64 = 2.0;

/// Draws both over image row `y`; `light` is the whole picture without rain.
pub(super) fn over_row(
    row: &mut [Colour],
    light: &[Colour],
    size: (u32, u32),
    y: usize,
    (seed, frame, time_s): (u64, usize, f64),
) {
    let (width, height) = (size.0 as f32, size.1 as f32);
    let unit = width / 1242.0;
    let y = y as f32;
    let uniform = |key: u64, i: i64, k: i64| hash::unit(seed ^ key, i, k);
    // Streaks are independent in every frame: they fall out of the image within one.
    for i in 0..STREAKS {
        let at = i + STREAKS * frame as i64;
        let (top, length) = (
            uniform(0x7a1, at, 0) * height * 1.2 - 0.1 * height,
            (10.0 + 30.0 * uniform(0x7a1, at, 1)) * unit,
        );
        if y < top || y > top + length {
            continue;
        }
        let along = (y - top) / length;
        let x = uniform(0x7a1, at, 2) * width + (y - top) * (0.12 * (uniform(0x7a1, at, 3) - 0.5));
        let strength = (0.05 + 0.10 * uniform(0x7a1, at, 4)) * (4.0 * along * (1.0 - along));
        let first = x.floor();
        for (column, share) in [(first, 1.0 - (x - first)), (first + 1.0, x - first)] {
            if let Some(pixel) = (column >= 0.0).then(|| row.get_mut(column as usize)).flatten() {
                *pixel = mixed(*pixel, [0.75, 0.77, 0.79], strength * share);
            }
        }
    }
    for i in 0..DROPS {
        // Drops come and go one by one.
        let age = time_s / DROP_S + f64::from(uniform(0xd70, i, 9));
        let at = i + DROPS * age.floor() as i64;
        let (cx, cy) = (uniform(0xd70, at, 0) * width, uniform(0xd70, at, 1) * height);
        let radius = (5.0 + 9.0 * uniform(0xd70, at, 2)) * unit;
        let reach = (radius * radius - (y - cy) * (y - cy)).max(0.0).sqrt();
        let (from, to) =
            ((cx - reach).ceil().max(0.0) as usize, ((cx + reach) as usize).min(row.len().saturating_sub(1)));
        if reach <= 0.0 || from > to {
            continue;
        }
        for x in from..=to {
            let (dx, dy) = ((x as f32 - cx) / radius, (y - cy) / radius);
            let edge = dx * dx + dy * dy;
            // A drop is a small lens: its image is inverted and out of focus.
            let (u, v) = (cx - 3.0 * dx * radius, cy - 3.0 * dy * radius);
            let (u, v) = (u.clamp(0.0, width - 1.0) as usize, v.clamp(0.0, height - 1.0) as usize);
            if let Some(seen) = light.get(v * size.0 as usize + u) {
                let soft = ((1.0 - edge) * 3.0).clamp(0.0, 1.0);
                row[x] = mixed(row[x], *seen, 0.55 * soft);
            }
        }
    }
}
