//! Extraction of features from an image.

use image::GrayImage;

use super::blur::Blurred;
use super::corners::{Corner, corners};
use super::descriptor::Descriptor;
use super::feature::Feature;
use super::halve::reduced;
use super::orientation;
use super::pattern::{Pattern, RADIUS_PX};
use super::spread::spread;
use crate::options::FeatureOptions;

/// Finds features in images; keeps its buffers.
#[derive(Clone, Debug, Default)]
pub struct FeatureExtractor {
    options: FeatureOptions,
    blurred: Blurred,
}

impl FeatureExtractor {
    /// With these options.
    pub fn new(options: FeatureOptions) -> Self {
        Self { options, blurred: Blurred::default() }
    }

    /// Features where `usable(x, y)` allows it (pixels of the full image), finest level first. Points on vehicles and on what is fixed
    /// to the camera are not part of a place.
    pub fn extract(&mut self, image: &GrayImage, usable: impl Fn(f64, f64) -> bool) -> Vec<Feature> {
        let options = self.options;
        let mut out = Vec::with_capacity(options.count);
        let mut smaller: Option<GrayImage> = None;
        let mut scale = 1.0;
        let shares = shares(&options);
        for (level, share) in shares.iter().enumerate() {
            if level > 0 {
                scale *= options.level_scale;
                let next = reduced(smaller.as_ref().unwrap_or(image), options.level_scale);
                smaller = Some(next);
            }
            let current = smaller.as_ref().unwrap_or(image);
            if current.width().min(current.height()) as i32 <= 2 * BORDER_PX {
                break;
            }
            // Centre of a pixel of this level in the full image.
            let full = |v: i32| (f64::from(v) + 0.5) * scale - 0.5;
            let mut found = corners(current, options.threshold, BORDER_PX);
            found.retain(|c| usable(full(c.x), full(c.y)));
            let chosen = spread(&found, current.dimensions(), *share);
            self.blurred.refill(current);
            out.extend(chosen.iter().map(|c| {
                let turn = orientation::turn(current, c.x, c.y);
                Feature {
                    descriptor: describe(&self.blurred, c, turn),
                    pixel: [full(c.x) as f32, full(c.y) as f32],
                    level: level as u8,
                    turn,
                }
            }));
        }
        out
    }
}

/// Distance of corners from the edge of a level \[px\]: the patch and its blur.
const BORDER_PX: i32 = RADIUS_PX + 3;

/// Features of each level, in proportion to its area's root: coarse levels have fewer corners, but more stable ones.
fn shares(options: &FeatureOptions) -> Vec<usize> {
    let weights: Vec<f64> = (0..options.levels).map(|k| options.level_scale.powi(-(k as i32))).collect();
    let whole: f64 = weights.iter().sum();
    weights.iter().map(|w| (w / whole * options.count as f64).round() as usize).collect()
}

fn describe(blurred: &Blurred, corner: &Corner, turn: u8) -> Descriptor {
    let mut bits = [0_u64; 4];
    for (k, test) in Pattern::shared().at(turn).iter().enumerate() {
        let [ax, ay, bx, by] = test.map(i32::from);
        let less = blurred.at(corner.x + ax, corner.y + ay) < blurred.at(corner.x + bx, corner.y + by);
        bits[k / 64] |= u64::from(less) << (k % 64);
    }
    Descriptor(bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;
    use rand::{Rng, SeedableRng};

    /// Rectangles of random grey values.
    fn scene(width: u32, height: u32, seed: u64) -> GrayImage {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut image = GrayImage::from_pixel(width, height, Luma([100]));
        for _ in 0..220 {
            let (x, y) = (rng.random_range(0..width), rng.random_range(0..height));
            let (w, h) = (rng.random_range(8..40), rng.random_range(8..40));
            let grey = rng.random_range(0..=255);
            for yy in y..(y + h).min(height) {
                for xx in x..(x + w).min(width) {
                    image.put_pixel(xx, yy, Luma([grey]));
                }
            }
        }
        image
    }

    fn nearest(of: &Feature, among: &[Feature]) -> (u32, Feature) {
        among.iter().map(|f| (f.descriptor.distance(&of.descriptor), *f)).min_by_key(|m| m.0).unwrap()
    }

    #[test]
    fn a_shifted_and_brighter_image_has_the_same_features() {
        let image = scene(400, 200, 3);
        let moved = GrayImage::from_fn(400, 200, |x, y| {
            let v = if x >= 6 { image.get_pixel(x - 6, y).0[0] } else { 0 };
            Luma([(f32::from(v) * 0.8 + 30.0) as u8])
        });
        let mut extractor = FeatureExtractor::new(FeatureOptions::default());
        let (a, b) = (extractor.extract(&image, |_, _| true), extractor.extract(&moved, |_, _| true));
        assert!(a.len() > 150 && a.len() <= FeatureOptions::default().count + 4, "{}", a.len());
        let good = a.iter().filter(|f| {
            let (distance, g) = nearest(f, &b);
            distance < 40
                && (g.pixel[0] - f.pixel[0] - 6.0).abs() < 1.5
                && (g.pixel[1] - f.pixel[1]).abs() < 1.5
        });
        let share = good.count() as f64 / a.len() as f64;
        // On coarser levels the shift is no whole number of pixels, and other corners win.
        assert!(share > 0.55, "{share}");
    }

    #[test]
    fn a_rotated_image_has_the_same_descriptors_and_turned_orientations() {
        let image = scene(300, 300, 5);
        let rotated = image::imageops::rotate90(&image);
        let mut extractor = FeatureExtractor::new(FeatureOptions::default());
        let (a, b) = (extractor.extract(&image, |_, _| true), extractor.extract(&rotated, |_, _| true));
        let good = a.iter().filter(|f| {
            let (distance, g) = nearest(f, &b);
            let expected = [299.0 - f.pixel[1], f.pixel[0]];
            let near = (g.pixel[0] - expected[0]).hypot(g.pixel[1] - expected[1]) < 2.5;
            distance < 50 && near && g.turn.wrapping_sub(f.turn).abs_diff(64) < 8
        });
        let share = good.count() as f64 / a.len() as f64;
        assert!(share > 0.6, "{share}");
    }

    #[test]
    fn left_out_regions_have_no_features() {
        let image = scene(400, 200, 7);
        let found = FeatureExtractor::new(FeatureOptions::default()).extract(&image, |x, _| x < 100.0);
        assert!(!found.is_empty() && found.iter().all(|f| f.pixel[0] < 100.0));
    }
}
