//! Sums over small squares: single pixels are too noisy to be compared.

use image::GrayImage;

/// Half side of the square \[px\]: BRIEF's 5×5 and more lose little and resist noise.
const HALF_PX: usize = 2;

/// Sum of the grey values of the 5×5 pixels around each pixel; the border of two pixels is zero.
#[derive(Clone, Debug, Default)]
pub(super) struct Blurred {
    width: usize,
    sums: Vec<u16>,
    /// Sums of five pixels of each row.
    rows: Vec<u16>,
}

impl Blurred {
    /// As a new one, in place.
    pub(super) fn refill(&mut self, image: &GrayImage) {
        const SIDE: usize = 2 * HALF_PX + 1;
        let (width, height) = (image.width() as usize, image.height() as usize);
        self.width = width;
        self.rows.clear();
        self.rows.resize(width * height, 0);
        self.sums.clear();
        self.sums.resize(width * height, 0);
        if width < SIDE || height < SIDE {
            return;
        }
        for (from, to) in image.as_raw().chunks_exact(width).zip(self.rows.chunks_exact_mut(width)) {
            let mut sum: u16 = from[..SIDE].iter().map(|v| u16::from(*v)).sum();
            to[HALF_PX] = sum;
            for ((entering, leaving), to) in from[SIDE..].iter().zip(from).zip(&mut to[HALF_PX + 1..]) {
                sum = sum + u16::from(*entering) - u16::from(*leaving);
                *to = sum;
            }
        }
        for y in HALF_PX..height - HALF_PX {
            let to = &mut self.sums[y * width..(y + 1) * width];
            for k in y - HALF_PX..=y + HALF_PX {
                let from = &self.rows[k * width..(k + 1) * width];
                for (to, from) in to.iter_mut().zip(from) {
                    *to += from;
                }
            }
        }
    }

    #[inline]
    pub(super) fn at(&self, x: i32, y: i32) -> u16 {
        self.sums.get(y as usize * self.width + x as usize).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn sums_are_those_of_the_square() {
        let image = GrayImage::from_fn(9, 8, |x, y| Luma([(x * 7 + y * 13) as u8]));
        let mut blurred = Blurred::default();
        blurred.refill(&image);
        let direct: u16 = (2..7)
            .flat_map(|y| (3..8).map(move |x| (x, y)))
            .map(|(x, y)| u16::from(image.get_pixel(x, y).0[0]))
            .sum();
        assert_eq!(blurred.at(5, 4), direct);
    }
}
