//! Shares of a pixel that stripes cover.

use super::tile::floor;

/// Share of [low, high] in an interval of the given width about x.
#[inline]
pub(super) fn cover(x: f32, low: f32, high: f32, width: f32) -> f32 {
    let width = width.max(1e-4);
    let (a, b) = ((x - 0.5 * width).max(low), (x + 0.5 * width).min(high));
    ((b - a) / width).clamp(0.0, 1.0)
}

/// The same for [low, high] repeated every `period`, all within one period; exact for any width.
#[inline]
pub(super) fn cover_periodic(x: f32, low: f32, high: f32, period: f32, width: f32) -> f32 {
    let width = width.max(1e-4);
    let rate = 1.0 / period;
    // Integral from 0 of the indicator of the stripes.
    let integral = |x: f32| {
        let whole = floor(x * rate);
        whole * (high - low) + (x - whole * period - low).clamp(0.0, high - low)
    };
    let x = x - period * floor(x * rate);
    ((integral(x + 0.5 * width) - integral(x - 0.5 * width)) / width).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covers_are_exact_shares() {
        assert_eq!(cover(0.0, 0.0, 9.0, 1.0), 0.5);
        assert!((cover_periodic(7.3, 0.25, 0.5, 1.0, 100.0) - 0.25).abs() < 1e-3);
        assert!((cover_periodic(7.4, 0.25, 0.5, 1.0, 0.01) - 1.0).abs() < 1e-3);
        assert!(cover_periodic(-0.1, 0.25, 0.5, 1.0, 0.01) < 1e-3);
    }
}
