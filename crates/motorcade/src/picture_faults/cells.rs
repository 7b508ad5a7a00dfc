//! Brightness and texture of the cells of a picture.

use image::GrayImage;

/// Square cells of a picture, row by row. Pixels beyond the last whole cell are left out.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Cells {
    pub columns: usize,
    pub rows: usize,
    /// Side of a cell \[px\].
    pub side: usize,
    /// Mean of each cell \[grey levels\].
    pub means: Vec<f32>,
    /// Standard deviation of each cell \[grey levels\].
    pub deviations: Vec<f32>,
    /// Mean absolute difference of horizontal neighbours in each cell \[grey levels\].
    pub gradients: Vec<f32>,
}

impl Cells {
    /// Takes a picture in place of the one before; cells have sides of `least_px` or more.
    pub fn measure(&mut self, image: &GrayImage, columns: usize, least_px: usize) {
        let (width, height) = (image.width() as usize, image.height() as usize);
        self.side = (width / columns).max(least_px);
        (self.columns, self.rows) = (width / self.side, height / self.side);
        for values in [&mut self.means, &mut self.deviations, &mut self.gradients] {
            values.clear();
        }
        let pixels = image.as_raw();
        let n = (self.side * self.side) as f32;
        for (row, column) in (0..self.rows).flat_map(|r| (0..self.columns).map(move |c| (r, c))) {
            let (mut sum, mut squares, mut gradient) = (0_u64, 0_u64, 0_u64);
            for y in row * self.side..(row + 1) * self.side {
                let start = y * width + column * self.side;
                let line = pixels.get(start..start + self.side).unwrap_or_default();
                sum += u64::from(line.iter().map(|p| u32::from(*p)).sum::<u32>());
                squares += u64::from(line.iter().map(|p| u32::from(*p) * u32::from(*p)).sum::<u32>());
                let steps = line.iter().zip(line.iter().skip(1));
                gradient += u64::from(steps.map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>());
            }
            let mean = sum as f32 / n;
            self.means.push(mean);
            self.deviations.push((squares as f32 / n - mean * mean).max(0.0).sqrt());
            self.gradients.push(gradient as f32 / n);
        }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.means.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stripes_have_the_statistics_of_their_levels() {
        let image = GrayImage::from_fn(40, 20, |x, _| {
            image::Luma([if x < 20 { 50 } else { 100 + 20 * (x % 2) as u8 }])
        });
        let mut cells = Cells::default();
        cells.measure(&image, 4, 8);
        assert_eq!((cells.columns, cells.rows, cells.side, cells.len()), (4, 2, 10, 8));
        assert_eq!((cells.means[0], cells.deviations[0], cells.gradients[0]), (50.0, 0.0, 0.0));
        assert_eq!((cells.means[3], cells.deviations[3]), (110.0, 10.0));
        // Nine steps of twenty grey levels in a line of ten pixels.
        assert_eq!(cells.gradients[7], 18.0);
        cells.measure(&GrayImage::new(3, 3), 4, 8);
        assert_eq!(cells.len(), 0);
    }
}
