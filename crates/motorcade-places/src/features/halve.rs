//! Smaller images of the pyramid.

use image::GrayImage;

/// The image at `scale` pixels a pixel, by area: each pixel is the mean of those it covers, whole ones and parts.
pub(super) fn reduced(image: &GrayImage, scale: f64) -> GrayImage {
    let side = |n: u32| ((f64::from(n) / scale).floor() as u32).max(1);
    let (width, height) = (side(image.width()), side(image.height()));
    let (columns, rows) = (spans(image.width(), width, scale), spans(image.height(), height, scale));
    let from = image.width() as usize;
    let mut lines = vec![0.0_f32; from];
    let mut out = Vec::with_capacity((width * height) as usize);
    for row in &rows {
        lines.fill(0.0);
        for (k, weight) in row.weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let source = &image.as_raw()[(row.first + k) * from..(row.first + k + 1) * from];
            for (sum, v) in lines.iter_mut().zip(source) {
                *sum += weight * f32::from(*v);
            }
        }
        for column in &columns {
            let sum: f32 = lines[column.first..].iter().zip(column.weights).map(|(v, w)| v * w).sum();
            out.push((sum + 0.5) as u8);
        }
    }
    GrayImage::from_raw(width, height, out).unwrap_or_default()
}

/// Source pixels of one target pixel.
struct Span {
    first: usize,
    weights: [f32; 4],
}

fn spans(from: u32, to: u32, scale: f64) -> Vec<Span> {
    let last = from as usize - 1;
    let span = |k: u32| {
        let (begin, end) = (f64::from(k) * scale, (f64::from(k) * scale + scale).min(f64::from(from)));
        let first = (begin.floor() as usize).min(last);
        let share = |i: usize| {
            let at = (first + i) as f64;
            if first + i > last { 0.0 } else { ((at + 1.0).min(end) - at.max(begin)).max(0.0) }
        };
        let shares: [f64; 4] = std::array::from_fn(share);
        let whole: f64 = shares.iter().sum();
        Span { first, weights: shares.map(|s| (s / whole.max(1e-9)) as f32) }
    };
    (0..to).map(span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn a_ramp_stays_a_ramp_and_its_scale_changes() {
        let image = GrayImage::from_fn(130, 65, |x, _| Luma([x as u8]));
        let small = reduced(&image, 1.3);
        assert_eq!(small.dimensions(), (100, 50));
        for x in 0..100 {
            // Pixel centres at integers: small pixel x has its centre at 1.3 (x + 0.5) − 0.5.
            let expected = 1.3 * (f64::from(x) + 0.5) - 0.5;
            assert!((f64::from(small.get_pixel(x, 20).0[0]) - expected).abs() <= 1.0);
        }
    }
}
