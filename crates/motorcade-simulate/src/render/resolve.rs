//! From quarter pixels to pixels: every surface in a pixel is shaded once and weighted by its share.

use motorcade_geometry::{Camera, PinholeCamera, Pose};
use nalgebra::{Point2, Point3, Vector3};

use super::colour::Colour;
use super::raster::{Band, Drawn, value};
use super::scene::{Fragment, Scene};
use super::shade::shade;
use super::sky;
use crate::mesh::Material;
use crate::site::Site;

/// Surface of a drawn triangle.
pub(super) struct Surface {
    pub material: Material,
    /// In the site, towards the camera.
    pub normal: Vector3<f64>,
    /// Vehicle index + 1, 0 for the world.
    pub owner: u16,
}

/// The pixels of a band.
pub(super) struct Resolved {
    pub light: Vec<Colour>,
    pub depth_m: Vec<f32>,
    pub instance: Vec<u16>,
    pub road: Vec<u8>,
    /// Per vehicle: samples and extent in pixels.
    pub seen: Vec<(usize, VisiblePart)>,
}

/// Visible part of a vehicle: quarter pixels and their extent.
#[derive(Clone, Copy)]
pub(super) struct VisiblePart {
    pub samples: u64,
    pub low: [f64; 2],
    pub high: [f64; 2],
}

impl VisiblePart {
    pub(super) const NONE: Self = Self { samples: 0, low: [f64::MAX; 2], high: [f64::MIN; 2] };
    pub(super) fn add(&mut self, x: f64, y: f64) {
        self.samples += 1;
        self.low = [self.low[0].min(x), self.low[1].min(y)];
        self.high = [self.high[0].max(x), self.high[1].max(y)];
    }
    pub(super) fn merge(&mut self, other: &Self) {
        self.samples += other.samples;
        self.low = [self.low[0].min(other.low[0]), self.low[1].min(other.low[1])];
        self.high = [self.high[0].max(other.high[0]), self.high[1].max(other.high[1])];
    }
}

/// Rays of the pixels in the site, one metre deep: linear in the pixel.
pub(super) struct Rays {
    eye: Point3<f64>,
    /// Of the pixel (0, 0), and its change to the next pixel right and down.
    first: Vector3<f64>,
    right: Vector3<f64>,
    down: Vector3<f64>,
}

impl Rays {
    pub(super) fn of(camera: &PinholeCamera, pose: &Pose<Site, Camera>) -> Self {
        let at = |x: f64, y: f64| pose.transform_vector(&camera.ray(&Point2::new(x, y)));
        let first = at(0.0, 0.0);
        Self {
            eye: pose.translation().into(),
            first,
            right: at(1.0, 0.0) - first,
            down: at(0.0, 1.0) - first,
        }
    }
    pub(super) fn at(&self, x: f64, y: f64) -> Vector3<f64> {
        self.first + self.right * x + self.down * y
    }
}

/// Shades the pixels of a band.
pub(super) fn resolve(
    scene: &Scene<'_>,
    camera: &PinholeCamera,
    pose: &Pose<Site, Camera>,
    surfaces: &[Surface],
    drawn: &[Drawn],
    band: &Band,
) -> Resolved {
    let width = camera.width as usize;
    let rows = band.drawn.len() / (2 * band.columns);
    let mut out = Resolved {
        light: Vec::with_capacity(width * rows),
        depth_m: Vec::with_capacity(width * rows),
        instance: Vec::with_capacity(width * rows),
        road: Vec::with_capacity(width * rows),
        seen: Vec::new(),
    };
    let rays = Rays::of(camera, pose);
    // Colour and share of carriageway at a pixel position.
    let look = |px: f64, py: f64, id: u32| -> (Colour, f32) {
        let ray = rays.at(px, py);
        match drawn.get(id as usize) {
            None => {
                let direction = ray.normalize();
                (sky::colour(scene.textures, &scene.air, &direction, 1.0 / camera.fx), 0.0)
            }
            Some(triangle) => {
                let surface = &surfaces[triangle.surface as usize];
                let shaded = shade(scene, &fragment(&rays.eye, surface, triangle, &ray, (px, py)));
                (shaded.colour, shaded.road)
            }
        }
    };
    for r in 0..rows {
        let y = band.row + r;
        for x in 0..width {
            let (upper, lower) = (2 * r * band.columns + 2 * x, (2 * r + 1) * band.columns + 2 * x);
            let ids = [band.drawn[upper], band.drawn[upper + 1], band.drawn[lower], band.drawn[lower + 1]];
            let depths = &band.inverse_depth;
            let nearest = depths[upper].max(depths[upper + 1]).max(depths[lower]).max(depths[lower + 1]);
            if ids == [ids[0]; 4]
                && drawn.get(ids[0] as usize).is_none_or(|d| surfaces[d.surface as usize].owner == 0)
            {
                // Most pixels show one static surface.
                let (colour, road) = look(x as f64, y as f64, ids[0]);
                out.light.push(colour);
                // Extrapolated to the middle of the pixel from its nearest sample.
                let middle = |d: &Drawn| value(&d.inverse_depth, x as f64, y as f64) as f32;
                out.depth_m.push(1.0 / drawn.get(ids[0] as usize).map_or(0.0, middle).max(0.0));
                out.instance.push(0);
                out.road.push((255.0 * road + 0.5) as u8);
                continue;
            }
            // The first sample that shows the same surface; mostly all four do.
            let mut first = [0; 4];
            if ids != [ids[0]; 4] {
                for k in 1..4 {
                    let same = |j: &usize| first[*j] == *j && same_surface(surfaces, drawn, ids[*j], ids[k]);
                    first[k] = (0..k).find(same).unwrap_or(k);
                }
            }
            let owners =
                ids.map(|id| drawn.get(id as usize).map_or(0, |d| surfaces[d.surface as usize].owner));
            let (mut light, mut road) = ([0.0_f32; 3], 0.0_f32);
            for k in (0..4).filter(|k| first[*k] == *k) {
                // Shaded once, in the middle of its samples.
                let (mut count, mut px, mut py) = (0.0, 0.0, 0.0);
                for j in (k..4).filter(|j| first[*j] == k) {
                    (count, px, py) =
                        (count + 1.0, px + (j % 2) as f64 * 0.5 - 0.25, py + (j / 2) as f64 * 0.5 - 0.25);
                }
                let (px, py) = (x as f64 + px / count, y as f64 + py / count);
                let share = 0.25 * count as f32;
                let (colour, on_road) = look(px, py, ids[k]);
                road += share * on_road;
                let [r, g, b] = colour;
                light = [light[0] + share * r, light[1] + share * g, light[2] + share * b];
            }
            for (k, owner) in owners.iter().enumerate().filter(|o| *o.1 > 0) {
                let vehicle = usize::from(*owner) - 1;
                let place = match out.seen.iter().position(|s| s.0 == vehicle) {
                    Some(place) => place,
                    None => {
                        out.seen.push((vehicle, VisiblePart::NONE));
                        out.seen.len() - 1
                    }
                };
                out.seen[place]
                    .1
                    .add(x as f64 + (k % 2) as f64 * 0.5 - 0.25, y as f64 + (k / 2) as f64 * 0.5 - 0.25);
            }
            // A pixel belongs to the instance with the largest share; of equals to the first.
            let most = (0..4).rev().max_by_key(|k| owners.iter().filter(|o| **o == owners[*k]).count());
            out.light.push(light);
            out.depth_m.push(1.0 / nearest);
            out.instance.push(most.map_or(0, |k| owners[k]));
            out.road.push((255.0 * road + 0.5) as u8);
        }
    }
    out
}

/// True for two continuous triangles, which are shaded once.
fn same_surface(surfaces: &[Surface], drawn: &[Drawn], a: u32, b: u32) -> bool {
    if a == b {
        return true;
    }
    let (Some(a), Some(b)) = (drawn.get(a as usize), drawn.get(b as usize)) else { return false };
    let (a, b) = (&surfaces[a.surface as usize], &surfaces[b.surface as usize]);
    a.owner == b.owner && a.material == b.material && a.normal.dot(&b.normal) > 0.99
}

fn fragment(
    eye: &Point3<f64>,
    surface: &Surface,
    triangle: &Drawn,
    ray: &Vector3<f64>,
    (x, y): (f64, f64),
) -> Fragment {
    let inverse = &triangle.inverse_depth;
    let depth_m = 1.0 / value(inverse, x, y).max(1e-4);
    let [a, b, c] = &triangle.attributes;
    let at = [value(a, x, y) * depth_m, value(b, x, y) * depth_m, value(c, x, y) * depth_m];
    // d(a / w) = (da - (a / w) dw) / w
    let slope = |k: usize| {
        [
            (a[k] - at[0] * inverse[k]) * depth_m,
            (b[k] - at[1] * inverse[k]) * depth_m,
            (c[k] - at[2] * inverse[k]) * depth_m,
        ]
    };
    Fragment {
        material: surface.material,
        attributes: at,
        dx: slope(0),
        dy: slope(1),
        normal: surface.normal,
        point_in_site: eye + ray * depth_m,
        depth_m,
        ray: ray.normalize(),
        owner: surface.owner,
    }
}
