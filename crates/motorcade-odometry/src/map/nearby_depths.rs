//! Expected depth at a pixel, from the landmarks around it.

use motorcade_geometry::{Camera, Pose, World, robust::median};
use nalgebra::Point2;

use super::landmark::Landmark;
use super::options::{MOST_NEIGHBOURS, WindowOptions};
use crate::buffer::make_room;

/// Depths of landmarks by their pixel: the initial guess for corners without a position.
#[derive(Default)]
pub(crate) struct NearbyDepths {
    /// Pixel and inverse depth.
    known: Vec<(Point2<f64>, f64)>,
}

impl NearbyDepths {
    /// Replaces the depths by those of the landmarks in a camera at this pose.
    pub(crate) fn refill(&mut self, landmarks: &[Landmark], camera_from_world: &Pose<Camera, World>) {
        let one = |l: &Landmark| {
            let z = camera_from_world.transform_point(&l.point_in_world?).z;
            (z > 0.0).then_some((l.template_pixel?, 1.0 / z))
        };
        self.known.clear();
        self.known.extend(landmarks.iter().filter_map(one));
    }
    pub(crate) fn make_room(&mut self, landmarks: usize) {
        make_room(&mut self.known, landmarks);
    }
    /// Median depth of the nearest landmarks.
    pub(crate) fn around(&self, pixel: &Point2<f64>, options: &WindowOptions) -> Option<f64> {
        let count = options.depth_neighbours.clamp(1, MOST_NEIGHBOURS);
        let row_weight = options.depth_row_weight * options.depth_row_weight;
        let mut nearest = [(f64::MAX, 0.0); MOST_NEIGHBOURS];
        let nearest = &mut nearest[..count];
        for (p, inverse_depth) in &self.known {
            let d = p - pixel;
            let distance = d.x * d.x + row_weight * d.y * d.y;
            if distance < nearest[count - 1].0 {
                nearest[count - 1] = (distance, *inverse_depth);
                nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
            }
        }
        let found = nearest.iter().take_while(|n| n.0 < f64::MAX).count();
        let mut inverse = [0.0; MOST_NEIGHBOURS];
        for (inverse, n) in inverse.iter_mut().zip(&*nearest) {
            *inverse = n.1;
        }
        median(&mut inverse[..found]).map(|d| 1.0 / d)
    }
}
