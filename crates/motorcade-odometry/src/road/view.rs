//! Two images of the road and the pixels to compare.

use motorcade_geometry::{Camera, PinholeCamera, Pose};
use nalgebra::{Point2, Vector3};

use super::options::RoadOptions;
use super::pixels::RoadPixels;
use crate::tracking::Pyramid;

/// A road pixel of the current image.
pub(super) struct Sample {
    pub ray: Vector3<f64>,
    pub grey: f64,
    /// Share by which the motion is longer than that between the frames: its row is read later than the same place's row in the reference.
    pub longer: f64,
}

/// Buffers of the alignment, reused from frame to frame.
#[derive(Default)]
pub struct RoadScratch {
    pub(super) samples: Vec<Sample>,
    /// Absolute grey residuals.
    pub(super) absolute: Vec<f64>,
}

/// Two images of the road, the motion between them and the expected image.
#[derive(Clone, Copy)]
pub struct RoadView<'a> {
    /// Intrinsics of level 0.
    pub camera: &'a PinholeCamera,
    /// Current image.
    pub current: &'a Pyramid,
    /// Earlier image.
    pub reference: &'a Pyramid,
    /// Camera motion, eq. (2), in the odometry's unit.
    pub reference_from_current: Pose<Camera, Camera>,
    /// Expected m.
    pub guess: Vector3<f64>,
    /// Time by which a row is read later than the one above it, over the time between the frames; 0 for a global shutter.
    pub row_share: f64,
    /// Road pixels of the reference: without vehicles and their shadows.
    pub road_in_reference: &'a RoadPixels,
}

impl RoadView<'_> {
    /// Collects the road pixels of a level: inside the stretch, usable, textured; thinned evenly to the number allowed.
    pub(super) fn samples(
        &self,
        level: usize,
        usable: &impl Fn(&Point2<f64>) -> bool,
        options: &RoadOptions,
        out: &mut Vec<Sample>,
    ) {
        let image = self.current.level(level);
        let scale = f64::from(1u32 << level);
        let height = 1.0 / self.guess.norm();
        let (far, half_width) = (options.far_heights * height, options.half_width_heights * height);
        out.clear();
        let alignment = &options.advanced.alignment;
        let least = alignment.least_gradient * alignment.least_gradient;
        for y in 2..image.height().saturating_sub(3) {
            let v = y as f64 * scale;
            let (up, row, down) = (image.row(y - 1), image.row(y), image.row(y + 1));
            for x in self.stretch(v, scale, image.width(), far, half_width) {
                let gx = 0.5 * (row[x + 1] - row[x - 1]);
                let gy = 0.5 * (down[x] - up[x]);
                if gx * gx + gy * gy < least {
                    continue;
                }
                let pixel = Point2::new(x as f64 * scale, v);
                let ray = self.camera.ray(&pixel);
                if !usable(&pixel) {
                    continue;
                }
                let there = self.in_reference(&ray);
                if there.is_none_or(|p| self.road_in_reference.contains(&p)) {
                    let longer = there.map_or(0.0, |p| self.row_share * (v - p.y));
                    out.push(Sample { ray, grey: f64::from(row[x]), longer });
                }
            }
        }
        let keep_every = out.len().div_ceil(alignment.most_pixels.max(1)).max(1);
        if keep_every > 1 {
            let mut index = 0;
            out.retain(|_| {
                index += 1;
                index % keep_every == 0
            });
        }
    }

    /// Pixel of the reference that shows the same place, by the expected image.
    fn in_reference(&self, ray: &Vector3<f64>) -> Option<Point2<f64>> {
        let motion = &self.reference_from_current;
        let there = motion.transform_vector(ray) + motion.translation() * self.guess.dot(ray);
        (there.z > 1e-6).then(|| self.camera.project(&(there / there.z).into())).flatten()
    }

    /// Columns of a row of pixels (level 0: `v`) inside the stretch: nearer than `far`, within `half_width` of the camera. Depth
    /// and lateral position are linear in the column over a common denominator, so the columns are contiguous.
    fn stretch(&self, v: f64, scale: f64, width: usize, far: f64, half_width: f64) -> std::ops::Range<usize> {
        let ray = self.camera.ray(&Point2::new(0.0, v));
        let step = scale / self.camera.fx;
        // Inverse depth a + b x must exceed 1/far; |X| ≤ half width is ±(c + d x) ≤ half width (a + b x).
        let (a, b) = (self.guess.dot(&ray), self.guess.x * step);
        let (c, d) = (ray.x, step);
        let (mut low, mut high) = (2.0, width.saturating_sub(3) as f64);
        for (offset, slope) in [
            (a - 1.0 / far, b),
            (half_width * a - c, half_width * b - d),
            (half_width * a + c, half_width * b + d),
        ] {
            // offset + slope x ≥ 0
            if slope.abs() < 1e-15 {
                if offset < 0.0 {
                    high = low;
                }
            } else if slope > 0.0 {
                low = low.max(-offset / slope);
            } else {
                high = high.min((-offset / slope).floor() + 1.0);
            }
        }
        let (low, high) = (low.ceil().max(0.0) as usize, high.max(0.0) as usize);
        low..high.max(low)
    }
}
