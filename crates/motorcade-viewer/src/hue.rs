//! A colour for every vehicle.

/// Hue of the `index`-th vehicle \[deg\], in steps of the golden angle: all hues differ, and the first ones are far apart.
pub fn hue(index: usize) -> u32 {
    ((20.0 + index as f64 * 137.507_764).rem_euclid(360.0)) as u32
}

/// Red, green and blue \[0, 1\] of a vehicle with this hue \[deg\]: strong where it moves, pale where it is parked.
pub fn rgb(hue_deg: u32, moving: bool) -> [f64; 3] {
    let (saturation, lightness): (f64, f64) = if moving { (0.95, 0.55) } else { (0.45, 0.65) };
    let chroma = saturation * lightness.min(1.0 - lightness);
    [0.0, 8.0, 4.0].map(|offset| {
        let k = (offset + f64::from(hue_deg % 360) / 30.0) % 12.0;
        lightness - chroma * (k - 3.0).min(9.0 - k).clamp(-1.0, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::{hue, rgb};

    #[test]
    fn hues_are_those_of_the_colour_circle() {
        for (hue, strongest) in [(0, 0), (120, 1), (240, 2)] {
            let colour = rgb(hue, true);
            assert!(
                (0..3).all(|k| k == strongest || colour[k] < 0.2 && colour[strongest] > 0.9),
                "{colour:?}"
            );
        }
    }

    #[test]
    fn the_first_vehicles_look_different() {
        for a in 0..8 {
            for b in 0..a {
                let apart = hue(a).abs_diff(hue(b));
                assert!(apart.min(360 - apart) >= 20, "{a} and {b}");
            }
        }
    }
}
