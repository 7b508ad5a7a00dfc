//! Grey images of rendered views, warped into each other by their depth and poses.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade_geometry::{Camera, PinholeCamera, Pose};
use motorcade_simulate::{Drive, Picture, RenderOptions, Renderer, Scenario, Site, simulate};
use nalgebra::{Matrix3, Point2, Point3, Vector2, Vector3};

/// A drive with an ideal sensor.
pub fn drive(name: &str, frames: usize, width: u32) -> Drive {
    let mut options = RenderOptions::default().with_width(width);
    options.sensor.noise = 0.0;
    options.sensor.exposure_drift = 0.0;
    simulate(&Scenario::by_name(name).unwrap(), frames, 11, &options).unwrap()
}

/// A rendered frame.
pub struct View {
    pub camera: PinholeCamera,
    pub site_from_camera: Pose<Site, Camera>,
    pub picture: Picture,
    /// Grey levels, not rounded to whole ones.
    pub grey: Vec<f64>,
}

impl View {
    pub fn of(drive: &Drive, renderer: &Renderer<'_>, frame: usize) -> Self {
        let picture = renderer.render(frame).unwrap();
        let level = |p: &image::Rgb<u8>| {
            0.299 * f64::from(p.0[0]) + 0.587 * f64::from(p.0[1]) + 0.114 * f64::from(p.0[2])
        };
        let grey = picture.rgb.pixels().map(level).collect();
        Self { camera: drive.camera(), site_from_camera: drive.site_from_camera[frame], picture, grey }
    }

    fn index(&self, x: usize, y: usize) -> usize {
        y * self.camera.width as usize + x
    }

    pub fn depth_m(&self, x: usize, y: usize) -> f64 {
        f64::from(self.picture.depth_m[self.index(x, y)])
    }

    /// All of the pixel is carriageway, none of it a vehicle.
    pub fn is_road(&self, x: usize, y: usize) -> bool {
        let i = self.index(x, y);
        self.picture.road.as_raw()[i] == 255 && self.picture.instance.as_raw()[i] == 0
    }

    /// Neither the pixel nor one about it shows a vehicle.
    pub fn is_still(&self, x: usize, y: usize) -> bool {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        rows.flat_map(|y| columns.clone().map(move |x| (x, y)))
            .all(|(x, y)| self.picture.instance.as_raw()[self.index(x, y)] == 0)
    }

    /// Means over 2×2 pixels; camera and the rest are those of a view of half the size.
    pub fn halved(&self, half: &Self) -> Self {
        let (width, height) = (half.camera.width as usize, half.camera.height as usize);
        let mean = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            // An odd height leaves half a row: that of above serves.
            let below = (y + 1).min(self.camera.height as usize - 1);
            let row = |y: usize| self.grey[self.index(x, y)] + self.grey[self.index(x + 1, y)];
            0.25 * (row(y) + row(below))
        };
        Self {
            camera: half.camera,
            site_from_camera: half.site_from_camera,
            picture: half.picture.clone(),
            grey: (0..width * height).map(mean).collect(),
        }
    }

    /// Grey level between pixels (Catmull–Rom: no blur that depends on the place).
    pub fn at(&self, p: &Point2<f64>) -> Option<f64> {
        let (i, j) = (p.x.floor(), p.y.floor());
        let fits = i >= 1.0
            && j >= 1.0
            && i + 2.0 < f64::from(self.camera.width)
            && j + 2.0 < f64::from(self.camera.height);
        if !fits {
            return None;
        }
        let weights = |t: f64| {
            [
                0.5 * t * (-1.0 + t * (2.0 - t)),
                1.0 + 0.5 * t * t * (3.0 * t - 5.0),
                0.5 * t * (1.0 + t * (4.0 - 3.0 * t)),
                0.5 * t * t * (t - 1.0),
            ]
        };
        let (wx, wy) = (weights(p.x - i), weights(p.y - j));
        let mut sum = 0.0;
        for (dy, wy) in wy.iter().enumerate() {
            let first = self.index(i as usize - 1, j as usize + dy - 1);
            sum += wy * wx.iter().zip(&self.grey[first..first + 4]).map(|(w, g)| w * g).sum::<f64>();
        }
        Some(sum)
    }

    /// Position of a pixel's surface point in another view, and its depth.
    pub fn carried(&self, x: usize, y: usize, other: &Self) -> Option<(Point2<f64>, f64)> {
        let ray = self.camera.ray(&Point2::new(x as f64, y as f64));
        let point = Point3::from(ray * self.depth_m(x, y));
        let seen = (other.site_from_camera.inverse() * self.site_from_camera).transform_point(&point);
        Some((other.camera.project(&seen).filter(|_| seen.z > 0.5)?, seen.z))
    }
}

/// A pixel of one view in another.
pub struct Match<'a> {
    other: &'a View,
    level: f64,
    place: Point2<f64>,
    /// The pixel's footprint there, less a pixel's own width: averaged over it the other view is equally sharp.
    right: Vector2<f64>,
    down: Vector2<f64>,
}

impl Match<'_> {
    /// Grey level of the other view, moved by a shift.
    fn level_at(&self, shift: Vector2<f64>) -> Option<f64> {
        let mut sum = 0.0;
        for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            // Two points have the variance of a line of the same length.
            let off = (self.right * i + self.down * j) / 12.0_f64.sqrt();
            sum += 0.25 * self.other.at(&(self.place + off + shift))?;
        }
        Some(sum)
    }
}

/// All chosen pixels of `a` with chosen neighbours, in `b`.
pub fn matches<'a>(a: &View, b: &'a View, chosen: impl Fn(usize, usize) -> bool) -> Vec<Match<'a>> {
    let place = |x: usize, y: usize| chosen(x, y).then(|| a.carried(x, y, b)).flatten().map(|p| p.0);
    let spread = |edge: Vector2<f64>| edge * (edge.norm_squared() - 1.0).max(0.0).sqrt() / edge.norm();
    let mut out = Vec::new();
    for y in 1..a.camera.height as usize - 1 {
        for x in 1..a.camera.width as usize - 1 {
            if let (Some(place), Some(l), Some(r), Some(u), Some(d)) =
                (place(x, y), place(x - 1, y), place(x + 1, y), place(x, y - 1), place(x, y + 1))
            {
                let (right, down) = (spread(0.5 * (r - l)), spread(0.5 * (d - u)));
                out.push(Match { other: b, level: a.grey[a.index(x, y)], place, right, down });
            }
        }
    }
    out
}

/// Displacement of pixels from their predicted positions \[px\]: the shift that minimises the grey-level differences of all
/// matches.
pub fn shift(matches: &[Match<'_>]) -> Vector2<f64> {
    // Gauss-Newton over the shift and a common difference of brightness.
    let mut found = Vector3::<f64>::zeros();
    for _ in 0..6 {
        let (mut h, mut g) = (Matrix3::zeros(), Vector3::zeros());
        for one in matches {
            let at = |dx: f64, dy: f64| one.level_at(found.xy() + Vector2::new(dx, dy));
            let (Some(here), Some(l), Some(r), Some(u), Some(d)) =
                (at(0.0, 0.0), at(-0.5, 0.0), at(0.5, 0.0), at(0.0, -0.5), at(0.0, 0.5))
            else {
                continue;
            };
            let residual = here + found.z - one.level;
            if residual.abs() < 25.0 {
                let j = Vector3::new(r - l, d - u, 1.0);
                h += j * j.transpose();
                g += j * residual;
            }
        }
        let Some(step) = h.try_inverse().map(|i| i * g) else { break };
        found -= step;
    }
    found.xy()
}
