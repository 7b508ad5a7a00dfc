//! Places and sizes, which follow from the size of the image.

use crate::segment::Rectangle;

/// Width of the panel as a share of the image's height, and its least width \[px\].
const PANEL_SHARE: f64 = 0.62;
const PANEL_LEAST_PX: f64 = 150.0;

/// Sizes of a drawing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Size of the drawing \[px\]; even, as video codecs ask for.
    pub(crate) size: (u32, u32),
    /// The panel beside the image \[px\].
    pub(crate) panel: Rectangle,
    /// Height of capitals \[px\].
    pub(crate) capital_px: f64,
    /// Width of a plain line \[px\].
    pub(crate) line_px: f64,
}

impl Layout {
    /// Of an image of this size \[px\].
    pub(crate) fn of(width: u32, height: u32) -> Self {
        let high = f64::from(height);
        let panel_px = (PANEL_SHARE * high).max(PANEL_LEAST_PX).round() as u32;
        let even = |v: u32| v + v % 2;
        let size = (even(width + panel_px), even(height));
        let panel =
            Rectangle::new(f64::from(width) - 0.5, -0.5, f64::from(size.0) - 0.5, f64::from(size.1) - 0.5);
        let capital_px = (3.0 + 0.016 * high).clamp(6.0, 40.0);
        Self { size, panel, capital_px, line_px: (capital_px / 7.0).max(1.0) }
    }
}
