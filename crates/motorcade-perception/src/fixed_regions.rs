//! Parts of the picture that are fixed to the camera: bonnet, reflections and dirt on the windscreen, burnt-in text.
//!
//! While the camera drives, the mean of many frames blurs the scene and keeps what is fixed: there the gradient of the mean is
//! as large as the mean of the gradients. Edges along the direction of image motion (lane lines, kerbs) also stay sharp, so
//! that only gradients along that direction count.

use image::GrayImage;
use motorcade_geometry::PinholeCamera;

/// Search for regions that are fixed to the camera.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FixedRegionOptions {
    /// Frames from which a mask is made.
    pub least_frames: usize,
    /// Frames that are enough.
    pub most_frames: usize,
    /// Least time between two frames that are used while the camera drives \[s\]: the scene must have moved. Chosen; a longer one finds the mask later.
    pub interval_s: f64,
    /// First frames of a drive that are looked through before it is estimated as a whole, of which at most `most_frames` are used. More see more of the
    /// scene go by and take time.
    pub surveyed_frames: usize,
    /// Mean change of the picture against the frame used before, below which a frame is not used \[grey levels\]: the camera stands.
    pub least_change: f64,
    /// Pixels between two of that comparison \[px\].
    pub change_step_px: usize,
    /// Rows searched begin this far below the principal point \[focal lengths\]: the road there is nearer than ten camera heights and moves by
    /// pixels from frame to frame; a horizon may stay where it is.
    pub first_row: f64,
    /// Mean gradient from which a pixel has texture \[grey levels/px\].
    pub least_gradient: f32,
    /// Gradient of the mean over mean gradient: 1 for fixed edges; 0.2 to 0.3 (median) on the roads of five drives, 0.57 for their 99 %
    /// quantile.
    pub fixed_ratio: f32,
    /// Share of a gradient along the direction of image motion from which it counts: lane lines and kerbs stay sharp across it.
    pub along_motion: f32,
    /// Fixed pixels this near belong to one region \[px\].
    pub reach_px: usize,
    /// Pixels of a region, at least: fewer are noise of a sharp edge.
    pub least_pixels: usize,
    /// Width from which a region is an edge of the bonnet \[image widths\]. A car that is followed at a constant distance stays where it is too,
    /// but is narrower.
    pub bonnet_width: f64,
    /// Largest height of the edge of a bonnet over its width.
    pub bonnet_slope: f64,
    /// Margin around fixed pixels \[px\]: coarse pyramid levels mix pixels this far apart (a bonnet masked up to 6 px from its edge still held
    /// the road's alignment at zero motion).
    pub margin_px: usize,
    /// Share of the searched rows beyond which a mask is not believed: the camera did not move.
    pub most_masked: f64,
    /// Share of a region within a vehicle's box and shadow from which it is a part of that vehicle: one that sways leaves a region wider than it
    /// is.
    pub within_vehicle: f64,
    /// Height of the shadow below a vehicle's box \[heights of the box\].
    pub shadow_height: f64,
}

impl Default for FixedRegionOptions {
    fn default() -> Self {
        Self {
            least_frames: 15,
            most_frames: 60,
            interval_s: 0.1,
            surveyed_frames: 150,
            least_change: 2.0,
            change_step_px: 8,
            first_row: 0.1,
            least_gradient: 2.0,
            fixed_ratio: 0.7,
            along_motion: 0.3,
            reach_px: 2,
            least_pixels: 25,
            bonnet_width: 0.25,
            bonnet_slope: 0.35,
            margin_px: 12,
            most_masked: 0.6,
            within_vehicle: 0.5,
            shadow_height: 0.25,
        }
    }
}

/// Statistics of the frames of a drive.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct FixedRegions {
    #[serde(skip)]
    options: FixedRegionOptions,
    width: usize,
    height: usize,
    frames: usize,
    /// Sum of the smoothed pictures \[grey levels\].
    sum: Vec<f32>,
    /// Sum of their gradients \[grey levels/px\].
    gradient: Vec<f32>,
    /// Samples of the last frame used.
    last: Vec<u8>,
}

impl FixedRegions {
    /// Without frames.
    pub fn new(options: FixedRegionOptions) -> Self {
        Self { options, ..Self::default() }
    }

    /// The same statistics with these options, which are not kept with them in a file.
    #[must_use]
    pub fn with_options(self, options: FixedRegionOptions) -> Self {
        Self { options, ..self }
    }

    /// Options of the search.
    pub fn options(&self) -> &FixedRegionOptions {
        &self.options
    }

    /// Number of frames used so far.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Takes a frame; true when it was used. Frames of another size, and those that hardly differ from the one before, are not.
    pub fn observe(&mut self, image: &GrayImage) -> bool {
        let size = (image.width() as usize, image.height() as usize);
        if self.frames == 0 {
            (self.width, self.height) = size;
            self.sum = vec![0.0; size.0 * size.1];
            self.gradient = vec![0.0; size.0 * size.1];
        }
        if size != (self.width, self.height) || size.0 < 3 || size.1 < 3 {
            return false;
        }
        let options = self.options;
        let samples = samples(image, options.change_step_px);
        if self.frames > 0 && change(&self.last, &samples) < options.least_change {
            return false;
        }
        let smooth = smoothed(image);
        for y in 0..size.1 - 1 {
            for x in 0..size.0 - 1 {
                let at = y * size.0 + x;
                let [gx, gy] = [smooth[at + 1] - smooth[at], smooth[at + size.0] - smooth[at]];
                self.gradient[at] += gx.hypot(gy);
            }
        }
        self.sum.iter_mut().zip(&smooth).for_each(|(sum, value)| *sum += value);
        self.last = samples;
        self.frames += 1;
        true
    }

    /// The regions fixed to the camera, 255 in a picture of the frames' size; `None` where there are none, with fewer than
    /// [`FixedRegionOptions::least_frames`] frames, or when the camera did not move.
    pub fn mask(&self, camera: &PinholeCamera) -> Option<GrayImage> {
        let options = &self.options;
        if self.frames < options.least_frames {
            return None;
        }
        let first_row = (camera.cy + options.first_row * camera.fy).max(0.0) as usize;
        let fixed = self.fixed_pixels(camera, first_row);
        let mut mask = GrayImage::new(self.width as u32, self.height as u32);
        for region in regions(&fixed, self.width, options) {
            self.paint(&region, &mut mask);
        }
        let masked = mask.pixels().filter(|p| p.0[0] != 0).count();
        let searched = self.width * self.height.saturating_sub(first_row);
        (masked > 0 && (masked as f64) < options.most_masked * searched as f64).then_some(mask)
    }

    /// True for pixels with a fixed gradient along the direction of image motion.
    fn fixed_pixels(&self, camera: &PinholeCamera, first_row: usize) -> Vec<bool> {
        let (count, options) = (self.frames as f32, &self.options);
        let mut fixed = vec![false; self.width * self.height];
        for y in first_row..self.height.saturating_sub(1) {
            for x in 0..self.width - 1 {
                let at = y * self.width + x;
                let mean_gradient = self.gradient[at] / count;
                if mean_gradient < options.least_gradient {
                    continue;
                }
                let gx = (self.sum[at + 1] - self.sum[at]) / count;
                let gy = (self.sum[at + self.width] - self.sum[at]) / count;
                // The camera drives along its axis: the scene moves away from the principal point.
                let (rx, ry) = (x as f32 - camera.cx as f32, y as f32 - camera.cy as f32);
                let of_mean = gx.hypot(gy);
                let along = (gx * rx + gy * ry).abs() / rx.hypot(ry).max(1.0);
                fixed[at] = of_mean > options.fixed_ratio * (mean_gradient + 0.5)
                    && along > options.along_motion * of_mean;
            }
        }
        fixed
    }

    /// Paints a region with its margin; from the upper edge of a bonnet on, all rows.
    fn paint(&self, region: &[usize], mask: &mut GrayImage) {
        let FixedRegionOptions { margin_px, bonnet_width, bonnet_slope, .. } = self.options;
        let (mut left, mut right, mut top, mut bottom) = (self.width, 0, self.height, 0);
        for at in region {
            let (x, y) = (at % self.width, at / self.width);
            (left, right, top, bottom) = (left.min(x), right.max(x), top.min(y), bottom.max(y));
        }
        let (wide, high) = ((right - left + 1) as f64, (bottom - top + 1) as f64);
        let bonnet = wide >= bonnet_width * self.width as f64 && high <= bonnet_slope * wide;
        for at in region {
            let (x, y) = (at % self.width, at / self.width);
            fill(mask, x, y.saturating_sub(margin_px)..y + margin_px + 1, margin_px);
        }
        if bonnet {
            // The corners beside an arch show a few square metres of road, too near to be worth a search for the exact edge.
            (0..self.width)
                .for_each(|x| fill(mask, x, top.saturating_sub(margin_px)..self.height, margin_px));
        }
    }
}

/// Sets rows of a column and of the margin to both sides.
fn fill(mask: &mut GrayImage, column: usize, rows: std::ops::Range<usize>, margin_px: usize) {
    let (width, height) = (mask.width() as usize, mask.height() as usize);
    for y in rows.start..rows.end.min(height) {
        for x in column.saturating_sub(margin_px)..(column + margin_px + 1).min(width) {
            mask.put_pixel(x as u32, y as u32, image::Luma([255]));
        }
    }
}

/// Columns and rows of the non-zero pixels of a mask \[px\], region by region.
pub fn connected_regions(mask: &GrayImage, options: &FixedRegionOptions) -> Vec<Vec<(u32, u32)>> {
    let width = mask.width();
    let set: Vec<bool> = mask.pixels().map(|p| p.0[0] != 0).collect();
    let places = |region: Vec<usize>| {
        region.into_iter().map(|at| (at as u32 % width, at as u32 / width)).collect::<Vec<_>>()
    };
    if set.is_empty() {
        Vec::new()
    } else {
        regions(&set, width as usize, options).into_iter().map(places).collect()
    }
}

/// Groups of fixed pixels that are near each other, without small ones.
fn regions(fixed: &[bool], width: usize, options: &FixedRegionOptions) -> Vec<Vec<usize>> {
    let (height, reach_px) = (fixed.len() / width, options.reach_px);
    let mut free = fixed.to_vec();
    let mut out = Vec::new();
    for start in 0..fixed.len() {
        if !free[start] {
            continue;
        }
        free[start] = false;
        let mut region = vec![start];
        let mut next = 0;
        while next < region.len() {
            let (x, y) = (region[next] % width, region[next] / width);
            next += 1;
            for v in y.saturating_sub(reach_px)..(y + reach_px + 1).min(height) {
                for u in x.saturating_sub(reach_px)..(x + reach_px + 1).min(width) {
                    let at = v * width + u;
                    if free[at] {
                        free[at] = false;
                        region.push(at);
                    }
                }
            }
        }
        if region.len() >= options.least_pixels {
            out.push(region);
        }
    }
    out
}

fn samples(image: &GrayImage, step_px: usize) -> Vec<u8> {
    let columns = (0..image.width()).step_by(step_px);
    let rows = (0..image.height()).step_by(step_px);
    rows.flat_map(|y| columns.clone().map(move |x| image.get_pixel(x, y).0[0])).collect()
}

/// Mean absolute difference.
fn change(a: &[u8], b: &[u8]) -> f64 {
    let sum: u64 = a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.len().max(1) as f64
}

/// Mean over 3×3 pixels; the outermost ones as they are.
fn smoothed(image: &GrayImage) -> Vec<f32> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let raw = image.as_raw();
    let mut out: Vec<f32> = raw.iter().map(|v| f32::from(*v)).collect();
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let row = |dy: usize| {
                let at = (y + dy - 1) * width + x;
                u32::from(raw[at - 1]) + u32::from(raw[at]) + u32::from(raw[at + 1])
            };
            out[y * width + x] = (row(0) + row(1) + row(2)) as f32 / 9.0;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use image::Luma;

    use super::*;

    const CAMERA: PinholeCamera =
        PinholeCamera { fx: 200.0, fy: 200.0, cx: 160.0, cy: 80.0, width: 320, height: 200 };
    /// First row of the bonnet at the middle; it is an arch.
    const BONNET: f64 = 170.0;

    fn bonnet_row(x: f64) -> f64 {
        BONNET + 0.0008 * (x - 160.0).powi(2)
    }

    /// A road with texture and a lane line, driven over; with a bonnet and a reflection in it.
    fn frame(driven: f64, fixed: bool) -> GrayImage {
        GrayImage::from_fn(320, 200, |u, v| {
            let (x, y) = (f64::from(u), f64::from(v));
            if fixed && y > bonnet_row(x) {
                return Luma([30]);
            }
            if fixed && (40.0..64.0).contains(&x) && (130.0..138.0).contains(&y) {
                return Luma([220]);
            }
            if y <= 82.0 {
                return Luma([150]);
            }
            let ahead = 300.0 / (y - 80.0);
            // A car sways within its lane.
            let aside = (x - 160.0) * ahead / 200.0 + 0.2 * (0.31 * driven).sin();
            // Edges as wide as a pixel, as a lens makes them.
            let pixel = ahead / 200.0;
            let line = (0.5 + (0.08 - (aside - 1.2).abs()) / pixel).clamp(0.0, 1.0);
            let z = ahead + driven;
            let texture = (2.1 * z + 1.3 * aside).sin() + (3.7 * z - 2.0 * aside).sin() * (5.0 * aside).cos();
            // Texture finer than a pixel fades.
            let fading = 1.0 + (3.7 * ahead * ahead / 300.0).powi(4);
            let road = 110.0 + 25.0 * texture / fading;
            Luma([(road + (235.0 - road) * line).clamp(0.0, 255.0) as u8])
        })
    }

    fn found(fixed: bool, metres_a_frame: f64) -> (usize, Option<GrayImage>) {
        let mut regions = FixedRegions::default();
        for k in 0..40 {
            regions.observe(&frame(f64::from(k) * metres_a_frame, fixed));
        }
        (regions.frames(), regions.mask(&CAMERA))
    }

    #[test]
    fn bonnet_and_reflection_are_found_and_the_road_is_left() {
        let mask = found(true, 0.53).1.unwrap();
        let set = |x: u32, y: u32| mask.get_pixel(x, y).0[0] != 0;
        for x in [20, 90, 160, 230, 300] {
            let edge = bonnet_row(f64::from(x)) as u32;
            assert!(edge >= 199 || (edge..200).all(|y| set(x, y)), "bonnet at column {x}");
            assert!(!set(x, BONNET as u32 - 15), "road above the bonnet at column {x}");
        }
        assert!((42..62).all(|x| set(x, 130) && set(x, 137)), "reflection");
        let road =
            (100..150).flat_map(|y| (80..240).map(move |x| (x, y))).filter(|(x, y)| set(*x, *y)).count();
        assert!(road < 80, "{road} pixels of the road");
    }

    #[test]
    fn a_free_road_with_lane_lines_has_no_mask() {
        let mask = found(false, 0.53).1;
        let at = mask.iter().flat_map(|m| m.enumerate_pixels().filter(|(.., p)| p.0[0] != 0));
        assert_eq!(at.map(|(x, y, _)| (x, y)).collect::<Vec<_>>(), []);
    }

    #[test]
    fn a_camera_that_stands_shows_nothing() {
        assert_eq!(found(true, 0.0), (1, None));
    }

    #[test]
    fn frames_of_another_size_are_left_out() {
        let mut regions = FixedRegions::default();
        assert!(regions.observe(&frame(0.0, true)));
        assert!(!regions.observe(&GrayImage::new(10, 10)));
        assert!(!FixedRegions::default().observe(&GrayImage::new(1, 1)));
    }
}
