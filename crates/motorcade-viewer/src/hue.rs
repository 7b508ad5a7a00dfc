//! A colour for every vehicle.

/// Hue of the `index`-th vehicle \[deg\], in steps of the golden angle: all hues differ, and the first ones are far apart.
pub fn hue(index: usize) -> u32 {
    ((20.0 + index as f64 * 137.507_764).rem_euclid(360.0)) as u32
}

#[cfg(test)]
mod tests {
    use super::hue;

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
