//! Anti-aliased drawing on an RGB image. Pixel centres lie at integer coordinates.

use image::RgbImage;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform,
};

use crate::colour::{BLACK, Colour};
use crate::segment::{Pixel, Rectangle};

/// Look of a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pen {
    pub(crate) colour: Colour,
    /// Width \[px\].
    pub(crate) width: f64,
    /// Lengths of dashes and of the gaps between them \[px\]; solid where absent.
    pub(crate) dash: Option<[f64; 2]>,
    /// Width of the dark seam on both sides \[px\], which keeps the line legible on bright pixels; 0 for none.
    pub(crate) seam: f64,
}

/// Opacity of the seam around lines and text.
const SEAM_OPACITY: f64 = 0.55;

impl Pen {
    pub(crate) fn new(colour: Colour, width: f64) -> Self {
        Self { colour, width, dash: None, seam: 0.0 }
    }
    pub(crate) fn seamed(self, seam: f64) -> Self {
        Self { seam, ..self }
    }
    pub(crate) fn dashed(self, dash: Option<[f64; 2]>) -> Self {
        Self { dash, ..self }
    }
}

/// An image to draw on.
pub(crate) struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// A canvas of this size with the image in its upper left corner; black elsewhere. `None` for a size that does not exist.
    pub(crate) fn new(image: &RgbImage, width: u32, height: u32) -> Option<Self> {
        let mut pixmap = Pixmap::new(width, height)?;
        let mut rows = image.chunks_exact(3 * image.width().max(1) as usize);
        for to in pixmap.data_mut().chunks_exact_mut(4 * width as usize) {
            to.iter_mut().skip(3).step_by(4).for_each(|opacity| *opacity = 255);
            let from = rows.next().unwrap_or_default();
            for (to, from) in to.chunks_exact_mut(4).zip(from.chunks_exact(3)) {
                to[..3].copy_from_slice(from);
            }
        }
        Some(Self { pixmap })
    }

    /// The drawn image.
    pub(crate) fn into_rgb(self) -> RgbImage {
        let mut image = RgbImage::new(self.pixmap.width(), self.pixmap.height());
        // The image below is opaque, so what is drawn on it is too: nothing to divide by.
        for (to, from) in image.chunks_exact_mut(3).zip(self.pixmap.data().chunks_exact(4)) {
            to.copy_from_slice(&from[..3]);
        }
        image
    }

    /// Lines through points each; where they cross they do not add up.
    pub(crate) fn lines<'a>(&mut self, lines: impl IntoIterator<Item = &'a [Pixel]>, pen: &Pen) {
        let mut builder = PathBuilder::new();
        for line in lines {
            add(&mut builder, line);
        }
        if let Some(path) = builder.finish() {
            self.stroke(&path, pen);
        }
    }

    /// The closed line around an ellipse of these half axes \[px\], the first one turned from right to down by an angle \[rad\].
    pub(crate) fn ellipse(&mut self, centre: Pixel, half_axes: [f64; 2], turn_rad: f64, pen: &Pen) {
        const SIDES: u32 = 40;
        let (sin, cos) = turn_rad.sin_cos();
        let point = |k: u32| {
            let (b, a) = (std::f64::consts::TAU * f64::from(k) / f64::from(SIDES)).sin_cos();
            let (a, b) = (a * half_axes[0], b * half_axes[1]);
            [centre[0] + a * cos - b * sin, centre[1] + a * sin + b * cos]
        };
        let points: Vec<Pixel> = (0..=SIDES).map(point).collect();
        self.lines([points.as_slice()], pen);
    }

    /// A filled polygon.
    pub(crate) fn polygon(&mut self, corners: &[Pixel], colour: Colour) {
        let mut builder = PathBuilder::new();
        add(&mut builder, corners);
        builder.close();
        if let Some(path) = builder.finish() {
            self.pixmap.fill_path(&path, &paint(colour), FillRule::Winding, centred(), None);
        }
    }

    /// A filled rectangle.
    pub(crate) fn rectangle(&mut self, r: &Rectangle, colour: Colour) {
        if let Some(rect) = Rect::from_ltrb(r.x1 as f32, r.y1 as f32, r.x2 as f32, r.y2 as f32) {
            self.pixmap.fill_rect(rect, &paint(colour), centred(), None);
        }
    }

    fn stroke(&mut self, path: &Path, pen: &Pen) {
        let round = |width: f64, dash: Option<StrokeDash>| Stroke {
            width: width as f32,
            line_cap: if dash.is_some() { LineCap::Butt } else { LineCap::Round },
            line_join: LineJoin::Round,
            dash,
            ..Stroke::default()
        };
        if pen.seam > 0.0 {
            let seam = BLACK.faded(SEAM_OPACITY * f64::from(pen.colour.opacity));
            let stroke = round(pen.width + 2.0 * pen.seam, None);
            self.pixmap.stroke_path(path, &paint(seam), &stroke, centred(), None);
        }
        let dash = pen.dash.and_then(|d| StrokeDash::new(d.iter().map(|v| *v as f32).collect(), 0.0));
        self.pixmap.stroke_path(path, &paint(pen.colour), &round(pen.width, dash), centred(), None);
    }
}

fn add(builder: &mut PathBuilder, line: &[Pixel]) {
    for (k, [x, y]) in line.iter().enumerate() {
        let (x, y) = (*x as f32, *y as f32);
        if k == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
    }
}

/// tiny-skia has the corners of pixels at integer coordinates.
fn centred() -> Transform {
    Transform::from_translate(0.5, 0.5)
}

fn paint(colour: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    let opacity = (255.0 * colour.opacity).round() as u8;
    paint.set_color_rgba8(colour.red, colour.green, colour.blue, opacity);
    paint.anti_alias = true;
    paint
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_pass_through_and_lines_hit_pixel_centres() {
        let image = RgbImage::from_fn(9, 7, |x, y| image::Rgb([x as u8 * 20, y as u8 * 30, 7]));
        let mut canvas = Canvas::new(&image, 12, 7).unwrap();
        canvas.lines([[[0.0, 3.0], [8.0, 3.0]].as_slice()], &Pen::new(Colour::gray(255), 1.0));
        let drawn = canvas.into_rgb();
        assert_eq!(drawn.get_pixel(4, 3).0, [255; 3]);
        assert_eq!(drawn.get_pixel(4, 2).0, image.get_pixel(4, 2).0);
        assert_eq!(drawn.get_pixel(11, 6).0, [0; 3]);
        assert!(Canvas::new(&image, 0, 7).is_none());
    }
}
