//! Text of strokes.

use crate::canvas::{Canvas, Pen};
use crate::colour::Colour;
use crate::glyphs::{BASELINE, CAPITAL, GAP, glyph};
use crate::segment::Pixel;

/// Length of a dot in units of the strokes: a line of no length has no direction.
const DOT: f64 = 0.6;

/// Width of a text whose capitals are `capital_px` high \[px\].
pub(crate) fn width_px(text: &str, capital_px: f64) -> f64 {
    let units: f64 = text.chars().map(|c| glyph(c).0 + GAP).sum();
    (units - GAP).max(0.0) * capital_px / CAPITAL
}

/// Strokes of a text; its first letter starts at `start`, on the baseline.
fn strokes(text: &str, start: Pixel, capital_px: f64) -> Vec<Vec<Pixel>> {
    let unit = capital_px / CAPITAL;
    let (mut lines, mut x) = (Vec::new(), start[0]);
    for (width, all) in text.chars().map(glyph) {
        for stroke in all.split(' ').filter(|stroke| !stroke.is_empty()) {
            let digits: Vec<f64> = stroke.bytes().map(|b| f64::from(b.saturating_sub(b'0'))).collect();
            let point = |p: &[f64]| [x + p[0] * unit, start[1] - (p[1] - BASELINE) * unit];
            let mut line: Vec<Pixel> = digits.chunks_exact(2).map(point).collect();
            if let [[x, y]] = line[..] {
                line.push([x, y - DOT * unit]);
            }
            lines.push(line);
        }
        x += (width + GAP) * unit;
    }
    lines
}

impl Canvas {
    /// A text whose capitals are `capital_px` high, from the left end of its baseline, with a dark seam.
    pub(crate) fn text(&mut self, text: &str, start: Pixel, capital_px: f64, colour: Colour) {
        self.write(text, start, capital_px, colour, 0.6);
    }

    /// The same without a seam, for a dark background.
    pub(crate) fn plain_text(&mut self, text: &str, start: Pixel, capital_px: f64, colour: Colour) {
        self.write(text, start, capital_px, colour, 0.0);
    }

    fn write(&mut self, text: &str, start: Pixel, capital_px: f64, colour: Colour, seam: f64) {
        let lines = strokes(text, start, capital_px);
        let width = (0.15 * capital_px).max(1.2);
        let pen = Pen::new(colour, width).seamed(seam * width);
        self.lines(lines.iter().map(Vec::as_slice), &pen);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_as_wide_as_its_strokes() {
        let (text, start) = ("H0", [10.0, 50.0]);
        let points: Vec<Pixel> = strokes(text, start, 12.0).concat();
        let most = |k: usize| points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
        assert!((most(0) - 10.0 - width_px(text, 12.0)).abs() < 1e-9);
        assert_eq!(most(1), 50.0, "on the baseline");
        assert_eq!(points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min), 38.0, "capitals 12 px high");
        assert_eq!(width_px("", 12.0), 0.0);
    }
}
