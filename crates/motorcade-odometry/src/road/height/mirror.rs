//! A road that mirrors what stands above it, seen in one picture alone.
//!
//! A patch of a mirroring road is found again in its own column, upside down and higher up. On any other road a patch is found in
//! its own column no more often than in columns beside it, which serve as control: one time in five, whatever the texture.
//!
//! A point at depth Z and its mirror image have the same Z, and the road lies midway: with rays `r` of unit depth and the unit
//! normal n away from the camera, `nᵀ(r_above + r_below) Z = 2 h`. So each pair gives its distance in camera heights.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Point2, Vector3};

use super::mirror_options::MirrorOptions;
use crate::tracking::{Pyramid, PyramidLevel};

/// Columns compared: the patch's own and four beside it.
const COLUMNS: [isize; 5] = [0, -1, 1, -2, 2];

/// A point above the road and its mirror image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MirrorPair {
    /// Pixel of the point, of the level.
    pub above: (usize, usize),
    /// Inverse depth of both for a camera at height 1.
    pub inverse_depth: f64,
}

/// The picture and the road in it.
pub(crate) struct MirrorView<'a> {
    pub camera: &'a PinholeCamera,
    pub pyramid: &'a Pyramid,
    /// Unit normal of the road away from the camera.
    pub down: &'a Vector3<f64>,
    /// Farthest road, and its half width \[camera heights\].
    pub far_heights: f64,
    pub half_width_heights: f64,
    /// Pyramid level.
    pub level: usize,
}

/// Evidence for and against a mirror, over the last seconds.
#[derive(Clone, Debug)]
pub(crate) struct MirrorTest {
    options: MirrorOptions,
    /// Patches that agree best with their own column, and all that were compared.
    own: f64,
    compared: f64,
    /// Time since the last test \[s\].
    since_s: f64,
    mirrors: bool,
    pub scratch: MirrorScratch,
}

/// Buffers, kept for their memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct MirrorScratch {
    /// Middles of patches.
    places: Vec<(usize, usize)>,
    /// A normalised patch.
    patch: Vec<f32>,
}

/// State of a [`MirrorTest`] between two frames.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct MirrorState {
    own: f64,
    compared: f64,
    since_s: f64,
    mirrors: bool,
}

impl MirrorTest {
    pub fn new(options: MirrorOptions) -> Self {
        Self {
            options,
            own: 0.0,
            compared: 0.0,
            since_s: f64::INFINITY,
            mirrors: false,
            scratch: MirrorScratch::default(),
        }
    }

    /// The state after a frame.
    pub fn state(&self) -> MirrorState {
        let Self { options: _, own, compared, since_s, mirrors, scratch: _ } = self;
        MirrorState { own: *own, compared: *compared, since_s: *since_s, mirrors: *mirrors }
    }

    /// As after the frame of a state.
    pub fn from_state(options: MirrorOptions, state: MirrorState) -> Self {
        let MirrorState { own, compared, since_s, mirrors } = state;
        Self { options, own, compared, since_s, mirrors, scratch: MirrorScratch::default() }
    }

    /// True while the road mirrors.
    pub fn mirrors(&self) -> bool {
        self.mirrors
    }

    /// Tests a frame where it is time to, `elapsed_s` after the one before.
    pub fn process(&mut self, view: &MirrorView<'_>, usable: impl Fn(&Point2<f64>) -> bool, elapsed_s: f64) {
        let options = &self.options;
        self.since_s += elapsed_s;
        let undecided = self.compared < options.least_patches;
        if !options.enabled || !undecided && self.since_s < options.interval_s {
            return;
        }
        let kept = if self.since_s.is_finite() { (-self.since_s / options.forget_s).exp() } else { 0.0 };
        (self.own, self.compared, self.since_s) = (self.own * kept, self.compared * kept, 0.0);
        let MirrorScratch { places, patch } = &mut self.scratch;
        view.patches(usable, options.tested_patches, options, (&mut *places, &mut *patch));
        for (x, y) in places.iter().copied() {
            if let Some(own) = view.agrees_with_its_own_column((x, y), options, patch) {
                self.own += f64::from(u8::from(own));
                self.compared += 1.0;
            }
        }
        self.mirrors = self.decide();
    }

    /// Share of the texture that is a mirror image: chance gives one in five.
    fn share(&self) -> f64 {
        let chance = 1.0 / COLUMNS.len() as f64;
        (self.own / self.compared.max(1e-9) - chance) / (1.0 - chance)
    }

    fn decide(&self) -> bool {
        let options = &self.options;
        if self.mirrors {
            return self.share() > 0.5 * options.least_share;
        }
        let chance = 1.0 / COLUMNS.len() as f64;
        // The binomial distribution of the share without a mirror.
        let sigma = (chance / (1.0 - chance) * options.correlated_patches / self.compared.max(1e-9)).sqrt();
        self.compared >= options.least_patches
            && self.share() > options.least_share.max(options.least_sigmas * sigma)
    }
}

impl MirrorView<'_> {
    /// Points above the road with their mirror images on it; `visible` leaves out points that move.
    pub fn pairs(
        &self,
        usable: impl Fn(&Point2<f64>) -> bool,
        visible: impl Fn(&Point2<f64>) -> bool,
        options: &MirrorOptions,
        MirrorScratch { places, patch }: &mut MirrorScratch,
        out: &mut Vec<MirrorPair>,
    ) {
        out.clear();
        let scale = self.scale();
        self.patches(usable, options.matched_patches, options, (&mut *places, &mut *patch));
        for (x, y) in places.iter().copied() {
            self.patch((x, y), options, patch);
            let found = [x - 1, x, x + 1].map(|x| self.best(patch, x, self.rows(y, options), options));
            let best = found.into_iter().flatten().max_by(|a, b| a.correlation.total_cmp(&b.correlation));
            let Some(best) = best.filter(|b| b.correlation > options.least_correlation) else { continue };
            let pixel = |x: usize, y: f64| Point2::new(x as f64 * scale, y * scale);
            let (above, below) = (pixel(best.x, best.y), pixel(x, y as f64));
            let along = |p: &Point2<f64>| self.down.dot(&self.camera.ray(p));
            let inverse_depth = 0.5 * (along(&above) + along(&below));
            if inverse_depth > 0.0 && visible(&above) {
                out.push(MirrorPair { above: (best.x, best.y.round() as usize), inverse_depth });
            }
        }
    }

    fn image(&self) -> &PyramidLevel {
        self.pyramid.level(self.level)
    }

    fn scale(&self) -> f64 {
        f64::from(1u32 << self.level)
    }

    /// Middles of at most `most` textured patches of the stretch of road, evenly thinned, whose columns lie in the picture.
    fn patches(
        &self,
        usable: impl Fn(&Point2<f64>) -> bool,
        most: usize,
        options: &MirrorOptions,
        (places, patch): (&mut Vec<(usize, usize)>, &mut Vec<f32>),
    ) {
        let (image, scale) = (self.image(), self.scale());
        let half = options.patch_px;
        let margin = half + 2 * options.control_px + 2;
        places.clear();
        for y in (half..image.height().saturating_sub(half + 1)).step_by(2 * half) {
            for x in (margin..image.width().saturating_sub(margin + 1)).step_by(2 * half) {
                let pixel = Point2::new(x as f64 * scale, y as f64 * scale);
                let ray = self.camera.ray(&pixel);
                let inverse_depth = self.down.dot(&ray);
                let aside = (ray.x - self.down.x * inverse_depth).abs();
                let near =
                    inverse_depth * self.far_heights > 1.0 && aside < self.half_width_heights * inverse_depth;
                if near && usable(&pixel) && self.patch((x, y), options, patch) {
                    places.push((x, y));
                }
            }
        }
        let every = places.len().div_ceil(most.max(1)).max(1);
        let mut index = 0;
        places.retain(|_| {
            index += 1;
            (index - 1) % every == 0
        });
    }

    /// Fills a patch, turned upside down, of mean 0 and standard deviation 1; false where it has no texture.
    fn patch(&self, (x, y): (usize, usize), options: &MirrorOptions, out: &mut Vec<f32>) -> bool {
        let half = options.patch_px;
        let rows = (y - half..=y + half).rev();
        out.clear();
        rows.for_each(|row| out.extend_from_slice(&self.image().row(row)[x - half..=x + half]));
        let n = out.len() as f32;
        let mean = out.iter().sum::<f32>() / n;
        let sigma = (out.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / n).sqrt();
        out.iter_mut().for_each(|v| *v = (*v - mean) / sigma);
        f64::from(sigma) >= options.least_contrast
    }

    /// Rows in which the point may lie whose image lies in row y: from the mirror of an infinite distance down to the patch itself.
    fn rows(&self, y: usize, options: &MirrorOptions) -> std::ops::Range<usize> {
        let half = options.patch_px;
        // Row of the horizon below the middle of the picture.
        let horizon = (self.camera.cy - self.camera.fy * self.down.z / self.down.y) / self.scale();
        let least = (2.0 * horizon - y as f64).max(half as f64) as usize;
        least..y.saturating_sub(2 * half + 1)
    }

    /// True when the patch agrees best with its own column; `None` where there is nothing to search.
    fn agrees_with_its_own_column(
        &self,
        (x, y): (usize, usize),
        options: &MirrorOptions,
        patch: &mut Vec<f32>,
    ) -> Option<bool> {
        self.patch((x, y), options, patch);
        let rows = self.rows(y, options);
        let best = |column: isize| {
            let middle = x.saturating_add_signed(column * options.control_px as isize);
            let of = |x: usize| self.best(patch, x, rows.clone(), options).map(|b| b.correlation);
            [middle - 1, middle, middle + 1].into_iter().filter_map(of).reduce(f64::max)
        };
        let own = best(0)?;
        Some(COLUMNS[1..].iter().all(|c| best(*c).is_none_or(|other| other < own)))
    }

    /// The best agreement in a column.
    fn best(
        &self,
        patch: &[f32],
        x: usize,
        rows: std::ops::Range<usize>,
        options: &MirrorOptions,
    ) -> Option<Match> {
        let mut best: Option<Match> = None;
        let (mut before, mut last) = (f64::NAN, f64::NAN);
        for y in rows {
            let now = self.correlation(patch, (x, y), options);
            // A parabola through the neighbours of a maximum.
            if last >= before && last >= now && best.is_none_or(|b| last > b.correlation) {
                let curvature = before - 2.0 * last + now;
                let offset = if curvature < 0.0 { 0.5 * (before - now) / curvature } else { 0.0 };
                best = Some(Match { x, y: y as f64 - 1.0 + offset, correlation: last });
            }
            (before, last) = (last, now);
        }
        best
    }

    /// Correlation of a normalised patch with the picture.
    fn correlation(&self, patch: &[f32], (x, y): (usize, usize), options: &MirrorOptions) -> f64 {
        let half = options.patch_px;
        let side = 2 * half + 1;
        let (mut sum, mut squares, mut product) = (0.0_f32, 0.0_f32, 0.0_f32);
        for (k, row) in (y - half..=y + half).enumerate() {
            let values = &self.image().row(row)[x - half..=x + half];
            for (v, p) in values.iter().zip(&patch[k * side..(k + 1) * side]) {
                sum += v;
                squares += v * v;
                product += v * p;
            }
        }
        let n = (side * side) as f32;
        let variance = squares / n - (sum / n) * (sum / n);
        // The patch has mean 0, so that the picture's mean falls out; flat parts of the picture agree with nothing.
        f64::from(product / n / variance.max(1.0).sqrt())
    }
}

#[derive(Clone, Copy, Debug)]
struct Match {
    x: usize,
    y: f64,
    correlation: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};
    use rand::{Rng, SeedableRng};

    const CAMERA: PinholeCamera =
        PinholeCamera { fx: 200.0, fy: 200.0, cx: 159.5, cy: 40.0, width: 320, height: 160 };
    /// Row in which a wall stands on the road: 8 camera heights away.
    const FOOT: u32 = 65;

    /// A wall of random stones above the road; the road mirrors it or has stones of its own.
    fn picture(mirrors: bool) -> Pyramid {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut stones = || -> Vec<u8> { (0..80 * 40).map(|_| rng.random_range(20..220)).collect() };
        let (wall, road) = (stones(), stones());
        let image = GrayImage::from_fn(320, 160, |x, y| {
            let (stones, row) = match y {
                0..=FOOT => (&wall, y),
                _ if mirrors && y <= 2 * FOOT => (&wall, 2 * FOOT - y),
                _ => (&road, y),
            };
            Luma([stones[(row / 4 * 80 + x / 4) as usize]])
        });
        Pyramid::new(&image, 1)
    }

    fn view<'a>(pyramid: &'a Pyramid, down: &'a Vector3<f64>) -> MirrorView<'a> {
        MirrorView { camera: &CAMERA, pyramid, down, far_heights: 7.5, half_width_heights: 4.0, level: 0 }
    }

    #[test]
    fn a_mirror_is_told_from_a_road_with_texture() {
        for mirrors in [true, false] {
            let pyramid = picture(mirrors);
            let mut test = MirrorTest::new(MirrorOptions::default());
            let down = Vector3::y();
            (0..3).for_each(|_| test.process(&view(&pyramid, &down), |p| p.y < 120.0, 0.1));
            assert_eq!(test.mirrors(), mirrors, "{test:?}");
            assert!((test.share() - f64::from(u8::from(mirrors))).abs() < 0.25, "{test:?}");
        }
    }

    #[test]
    fn a_point_and_its_mirror_image_give_their_depth() {
        let (pyramid, down) = (picture(true), Vector3::y());
        let mut pairs = Vec::new();
        let options = MirrorOptions::default();
        let mut scratch = MirrorScratch::default();
        view(&pyramid, &down).pairs(|p| p.y < 120.0, |_| true, &options, &mut scratch, &mut pairs);
        assert!(pairs.len() > 20, "{}", pairs.len());
        let near = |pair: &&MirrorPair| (pair.inverse_depth * 8.0 - 1.0).abs() < 0.02;
        assert!(10 * pairs.iter().filter(near).count() > 9 * pairs.len(), "{pairs:?}");
        // Points that may move measure nothing.
        view(&pyramid, &down).pairs(|_| true, |_| false, &options, &mut scratch, &mut pairs);
        assert!(pairs.is_empty());
    }
}
