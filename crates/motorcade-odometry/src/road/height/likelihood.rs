//! Likelihood of the camera's height by two pictures of the road.

use std::cmp::Ordering;

use motorcade_geometry::lie::so3;
use motorcade_geometry::robust::median;
use motorcade_geometry::{Camera, PinholeCamera, Pose};
use nalgebra::{Point2, Vector3};

use super::mirror::MirrorPair;
use super::options::HeightOptions;
use crate::road::pixels::RoadPixels;
use crate::tracking::Pyramid;

/// A pixel of the current picture.
struct Sample {
    ray: Vector3<f64>,
    /// Component of the ray across the road, of a camera at height 1 above it: inverse depth.
    inverse_depth: f64,
    grey: f32,
    /// Row \[px\].
    row: f64,
    /// Change of the grey value along the motion.
    information: f32,
}

/// Pixels of the road that show its distance: those whose grey value changes along the motion.
#[derive(Default)]
pub(crate) struct HeightSamples {
    samples: Vec<Sample>,
    /// Independent ones among them.
    effective: f64,
    residuals: Vec<f32>,
    costs: Vec<Option<f64>>,
    known: Vec<f64>,
}

impl HeightSamples {
    /// Collects the pixels of the stretch of road below a camera. `down` is the unit normal away from the camera, `travel` the
    /// direction of motion.
    pub fn collect(
        &mut self,
        camera: &PinholeCamera,
        (current, before): (&Pyramid, &Pyramid),
        (down, travel): (&Vector3<f64>, &Vector3<f64>),
        far_heights: f64,
        usable: impl Fn(&Point2<f64>) -> bool,
        options: &HeightOptions,
    ) {
        let level = options.level.min(current.len() - 1);
        let (image, before) = (current.level(level), before.level(level));
        let scale = f64::from(1u32 << level);
        self.samples.clear();
        for y in 2..image.height().saturating_sub(3) {
            let v = y as f64 * scale;
            let rows = [image.row(y - 1), image.row(y), image.row(y + 1)];
            for x in 2..image.width().saturating_sub(3) {
                let pixel = Point2::new(x as f64 * scale, v);
                let ray = camera.ray(&pixel);
                let inverse_depth = down.dot(&ray);
                // Depth and distance aside in camera heights do not depend on the height.
                let aside = (ray.x - down.x * inverse_depth).abs();
                if inverse_depth * far_heights < 1.0 || aside > options.half_width_heights * inverse_depth {
                    continue;
                }
                let gx = 0.5 * f64::from(rows[1][x + 1] - rows[1][x - 1]);
                let gy = 0.5 * f64::from(rows[2][x] - rows[0][x]);
                // A change of height moves the pixel along the epipolar line, in proportion to its inverse depth.
                let along = gx * camera.fx * (travel.x - ray.x * travel.z)
                    + gy * camera.fy * (travel.y - ray.y * travel.z);
                // Pixels that look the same although the camera moved say nothing, and a bonnet or a reflection would say "no motion".
                let fixed = options.fixed_grey + options.fixed_px * gx.hypot(gy);
                if f64::from(before.row(y)[x] - rows[1][x]).abs() > fixed && usable(&pixel) {
                    let information = (along * inverse_depth).abs() as f32;
                    self.samples.push(Sample { ray, inverse_depth, grey: rows[1][x], row: v, information });
                }
            }
        }
        let informative = (options.informative_share * self.samples.len() as f64) as usize;
        self.effective = (informative as f64 / options.correlated_pixels).min(options.most_independent);
        let most = informative.min(options.most_pixels);
        if most < self.samples.len() {
            // Rows and columns decide between equals, so that the choice does not depend on the sorting.
            self.samples.sort_unstable_by(|a, b| {
                let place = |s: &Sample| (s.ray.y, s.ray.x);
                b.information
                    .total_cmp(&a.information)
                    .then(place(a).partial_cmp(&place(b)).unwrap_or(Ordering::Equal))
            });
            self.samples.truncate(informative);
            let every = informative.div_ceil(most.max(1)).max(1);
            let mut index = 0;
            self.samples.retain(|_| {
                index += 1;
                index % every == 0
            });
        }
    }

    /// Collects pixels about points above a road that mirrors them: their distance in camera heights is known by their mirror images.
    pub fn collect_mirrored(
        &mut self,
        camera: &PinholeCamera,
        (current, before): (&Pyramid, &Pyramid),
        pairs: &[MirrorPair],
        options: &HeightOptions,
    ) {
        let level = options.level.min(current.len() - 1);
        let (image, before) = (current.level(level), before.level(level));
        let scale = f64::from(1u32 << level);
        self.samples.clear();
        let reach = options.mirror.patch_px;
        for MirrorPair { above: (x, y), inverse_depth } in pairs.iter().copied() {
            for row in (y.saturating_sub(reach)..=y + reach).step_by(2) {
                for column in (x.saturating_sub(reach)..=x + reach).step_by(2) {
                    let grey = image.row(row)[column];
                    let fixed = f64::from(before.row(row)[column] - grey).abs() <= options.fixed_grey;
                    if !fixed {
                        let pixel = Point2::new(column as f64 * scale, row as f64 * scale);
                        let (ray, row) = (camera.ray(&pixel), pixel.y);
                        self.samples.push(Sample { ray, inverse_depth, grey, row, information: 1.0 });
                    }
                }
            }
        }
        // Pixels of a patch share its distance.
        self.effective = (pairs.len() as f64).min(options.most_independent);
    }

    /// Standard deviation of log height by an error of the normal \[rad\], which shifts all pixels alike: the median over the pixels.
    pub fn sigma_by_tilt(&self, tilt_sigma_rad: f64) -> f64 {
        let mut inverse_depths: Vec<f64> = self.samples.iter().map(|s| s.inverse_depth).collect();
        median(&mut inverse_depths).map_or(0.0, |inverse_depth| tilt_sigma_rad / inverse_depth)
    }

    /// Number of pixels compared.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// True when there are enough.
    pub fn enough(&self, options: &HeightOptions) -> bool {
        self.samples.len() >= options.least_pixels
    }

    /// Adds the log likelihoods of heights to `out`: of a Laplace distribution of the grey differences with unknown scale, relative
    /// to the median over the heights; nothing for heights at which too little road lies in both pictures.
    pub fn add_log_likelihood(
        &mut self,
        camera: &PinholeCamera,
        (reference, road): (&Pyramid, &RoadPixels),
        (reference_from_current, row_share): (&Pose<Camera, Camera>, f64),
        log_inverse_heights: impl Iterator<Item = f64>,
        options: &HeightOptions,
        out: &mut [f64],
    ) {
        let level = options.level.min(reference.len() - 1);
        let (image, scale) = (reference.level(level), 1.0 / f64::from(1u32 << level));
        let (r, t) = (reference_from_current.rotation_matrix(), reference_from_current.translation());
        let turning = so3::log(&reference_from_current.rotation());
        let Self { samples, residuals, costs, known, effective } = self;
        costs.clear();
        for log_inverse_height in log_inverse_heights {
            let inverse_height = log_inverse_height.exp();
            residuals.clear();
            for s in samples.iter() {
                let turned = r * s.ray;
                let project = |there: Vector3<f64>| {
                    let x = camera.fx * there.x / there.z + camera.cx;
                    let y = camera.fy * there.y / there.z + camera.cy;
                    (there.z >= 1e-6).then(|| Point2::new(x, y))
                };
                let moved = t * (s.inverse_depth * inverse_height);
                let Some(mut p) = project(turned + moved) else { continue };
                if row_share > 0.0 {
                    // Motion at constant velocity over the time between the two rows.
                    let longer = row_share * (s.row - p.y);
                    let turned = turned + turning.cross(&turned) * longer;
                    let Some(later) = project(turned + moved * (1.0 + longer)) else { continue };
                    p = later;
                }
                let grey = image.sample((p.x * scale) as f32, (p.y * scale) as f32);
                residuals.extend(grey.filter(|_| road.contains(&p)).map(|g| g - s.grey));
            }
            let enough = residuals.len() as f64 > options.least_overlap * samples.len() as f64;
            costs.push(enough.then(|| cost(residuals, options)));
        }
        known.clear();
        known.extend(costs.iter().flatten());
        let Some(typical) = median(known) else { return };
        for (out, cost) in out.iter_mut().zip(costs.iter()) {
            *out -= cost.map_or(0.0, |c| *effective * (c / typical).ln());
        }
    }
}

/// Mean of the capped grey differences about their own mean: exposure changes from picture to picture.
fn cost(residuals: &[f32], options: &HeightOptions) -> f64 {
    let capped = |r: f64| r.abs().min(options.capped_grey);
    let mean =
        residuals.iter().map(|r| f64::from(*r).clamp(-options.capped_grey, options.capped_grey)).sum::<f64>()
            / residuals.len().max(1) as f64;
    let sum: f64 = residuals.iter().map(|r| capped(f64::from(*r) - mean)).sum();
    sum / residuals.len().max(1) as f64 + options.least_grey
}
