//! Pyramidal Lucas–Kanade tracking of small patches (Baker & Matthews 2004, inverse compositional, translation only).
//!
//! The template is pre-warped by a known affine map, which removes the growth of near points from the residual.

use nalgebra::{Matrix2, Point2, Vector2};

use super::level::PyramidLevel;
use super::options::{AdvancedKltOptions, KltOptions};
use super::patch::{AREA, Template, sample_patch};
use super::pyramid::Pyramid;

/// A patch to track from one image to another.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// Position in the first image \[px\].
    pub from: Point2<f64>,
    /// Predicted position in the second image \[px\].
    pub expected: Point2<f64>,
    /// Local affine map of offsets from the second image to the first (2×2); identity when nothing is known.
    pub from_offset: Matrix2<f64>,
    /// Coarsest level to start on.
    pub top_level: usize,
}

/// Factor on the grey values of the second image that gives it the contrast of the first: exposure that jumps. Small changes are
/// those of the scene.
fn gain(from: &Pyramid, to: &Pyramid, options: &AdvancedKltOptions) -> f32 {
    let gain = from.contrast() / to.contrast();
    let jump = gain.max(1.0 / gain);
    if (options.same_gain..options.most_gain).contains(&jump) { gain } else { 1.0 }
}

fn iterate(
    template: &Template,
    (image, gain): (&PyramidLevel, f32),
    mut at: Point2<f32>,
    options: &KltOptions,
    patch: &mut [f32; AREA],
) -> Option<(Point2<f32>, f32)> {
    let mut rms = f32::MAX;
    for _ in 0..options.max_iterations {
        if !sample_patch(image, at, patch) {
            return None;
        }
        if gain != 1.0 {
            patch.iter_mut().for_each(|v| *v *= gain);
        }
        // Eight partial sums per term stay in registers, and their order is fixed.
        let mut mean = [0.0_f32; 8];
        for chunk in patch.chunks_exact(8) {
            for k in 0..8 {
                mean[k] += chunk[k];
            }
        }
        let mean = mean.iter().sum::<f32>() / AREA as f32;
        let (mut bx, mut by, mut ss) = ([0.0_f32; 8], [0.0_f32; 8], [0.0_f32; 8]);
        for i in (0..AREA).step_by(8) {
            for k in 0..8 {
                let r = patch[i + k] - mean - template.values[i + k];
                bx[k] += r * template.dx[i + k];
                by[k] += r * template.dy[i + k];
                ss[k] += r * r;
            }
        }
        let (bx, by, ss): (f32, f32, f32) = (bx.iter().sum(), by.iter().sum(), ss.iter().sum());
        let [ixx, ixy, iyy] = template.inverse_hessian;
        let step = Vector2::new(ixx * bx + ixy * by, ixy * bx + iyy * by);
        rms = (ss / AREA as f32).sqrt();
        at -= step;
        if !(at.x.is_finite() && at.y.is_finite()) {
            return None;
        }
        if step.norm() < options.advanced.epsilon_px {
            break;
        }
    }
    Some((at, rms))
}

/// Tracks one patch from `from` to `to`. `None` when it leaves the image, has no texture or looks different.
pub fn track(from: &Pyramid, to: &Pyramid, request: &Request, options: &KltOptions) -> Option<Point2<f64>> {
    let warp: Matrix2<f32> = request.from_offset.cast();
    let mut at: Point2<f32> = request.expected.cast();
    let mut patch = [0.0; AREA];
    let mut rms = f32::MAX;
    let gain = gain(from, to, &options.advanced);
    for level in (0..=request.top_level.min(to.len() - 1)).rev() {
        let scale = 1.0 / (1 << level) as f32;
        let centre: Point2<f32> = Point2::from(request.from.coords.cast::<f32>() * scale);
        // A coarse level may lack texture or touch the border; the finest one must succeed.
        let template = Template::new(from.level(level), centre, &warp, options.advanced.least_eigenvalue);
        let found = template.and_then(|t| {
            iterate(&t, (to.level(level), gain), Point2::from(at.coords * scale), options, &mut patch)
        });
        match found {
            Some((p, r)) => {
                at = Point2::from(p.coords / scale);
                rms = r;
            }
            None if level > 0 => {}
            None => return None,
        }
    }
    (rms <= options.advanced.max_rms).then(|| at.cast())
}

/// [`track`] with a forward–backward check. The backward pass starts with the error of the prediction: started at the true
/// point it would succeed on any weak texture.
pub fn track_checked(
    from: &Pyramid,
    to: &Pyramid,
    request: &Request,
    options: &KltOptions,
) -> Option<Point2<f64>> {
    let there = track(from, to, request, options)?;
    let advanced = &options.advanced;
    let near = (request.expected - there).norm() < advanced.near_return_px;
    let return_level = if near { advanced.near_return_level } else { advanced.far_return_level };
    let back = Request {
        from: there,
        expected: request.from + (request.expected - there),
        from_offset: request.from_offset.try_inverse()?,
        top_level: request.top_level.min(return_level),
    };
    let returned = track(to, from, &back, options)?;
    ((returned - request.from).norm() <= options.advanced.max_return_px).then_some(there)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};

    /// Smooth aperiodic texture.
    fn texture(x: f64, y: f64) -> f64 {
        128.0
            + 40.0 * (0.31 * x + 0.11 * y).sin()
            + 35.0 * (0.23 * y - 0.17 * x).cos()
            + 30.0 * (0.05 * x * 0.9 + 0.37 * y).sin()
    }

    fn render(map: impl Fn(f64, f64) -> (f64, f64)) -> Pyramid {
        let image = GrayImage::from_fn(240, 160, |x, y| {
            let (u, v) = map(f64::from(x), f64::from(y));
            Luma([texture(u, v).round().clamp(0.0, 255.0) as u8])
        });
        Pyramid::new(&image, 4)
    }

    #[test]
    fn follows_a_shift_to_sub_pixel() {
        let (a, b) = (render(|x, y| (x, y)), render(|x, y| (x - 7.3, y + 3.7)));
        let from = Point2::new(100.0, 80.0);
        let request = Request { from, expected: from, from_offset: Matrix2::identity(), top_level: 3 };
        let found = track_checked(&a, &b, &request, &KltOptions::default()).unwrap();
        assert!((found - Point2::new(107.3, 76.3)).norm() < 0.03, "{found}");
    }

    #[test]
    fn follows_through_a_jump_of_the_exposure() {
        let a = render(|x, y| (x, y));
        for factor in [0.4, 0.95, 1.8] {
            let image = GrayImage::from_fn(240, 160, |x, y| {
                let value = texture(f64::from(x) - 2.3, f64::from(y) + 1.7);
                Luma([(factor * (value - 128.0) + 128.0 * factor.min(1.0)).round().clamp(0.0, 255.0) as u8])
            });
            let b = Pyramid::new(&image, 4);
            let from = Point2::new(100.0, 80.0);
            let request = Request { from, expected: from, from_offset: Matrix2::identity(), top_level: 3 };
            let found = track_checked(&a, &b, &request, &KltOptions::default()).unwrap();
            assert!((found - Point2::new(102.3, 78.3)).norm() < 0.1, "{factor}: {found}");
        }
    }

    #[test]
    fn the_warp_compensates_growth() {
        let centre = (120.0, 80.0);
        let zoom = |x: f64, y: f64| (centre.0 + (x - centre.0) / 1.2, centre.1 + (y - centre.1) / 1.2);
        let (a, b) = (render(|x, y| (x, y)), render(zoom));
        let from = Point2::new(150.0, 95.0);
        let truth = Point2::new(156.0, 98.0);
        let request = Request { from, expected: from, from_offset: Matrix2::identity() / 1.2, top_level: 2 };
        let found = track(&a, &b, &request, &KltOptions::default()).unwrap();
        assert!((found - truth).norm() < 0.05, "{found}");
    }

    #[test]
    fn patches_that_leave_the_image_or_are_flat_are_rejected() {
        let a = render(|x, y| (x, y));
        let flat = Pyramid::new(&GrayImage::from_pixel(240, 160, Luma([90])), 4);
        let request = Request {
            from: Point2::new(100.0, 80.0),
            expected: Point2::new(500.0, 80.0),
            from_offset: Matrix2::identity(),
            top_level: 0,
        };
        assert!(track(&a, &a, &request, &KltOptions::default()).is_none());
        let still = Request { expected: request.from, ..request };
        assert!(track(&flat, &a, &still, &KltOptions::default()).is_none());
    }
}
