//! Initial positions of a vehicle of known orientation.

use motorcade_geometry::RoadPlane;
use motorcade_geometry::robust::median;
use nalgebra::{Matrix3, Point2, Vector2, Vector3};

use super::super::model::State;
use super::{NEAREST_M, Problem};

impl Problem<'_> {
    /// Translation of a vehicle of known orientation and shape from the rays of its points and the road, linear in t:
    ///
    /// ```text
    /// (R X + t)_x − x (R X + t)_z = 0,   (R X + t)_y − y (R X + t)_z = 0,   up·t = −h
    /// ```
    ///
    /// for rays (x, y, 1), reweighted a few times against outliers.
    pub fn linear_translation(&self, rotation: &Matrix3<f64>, state: &State) -> Option<Vector3<f64>> {
        let mut t = Vector3::new(0.0, 0.0, self.distance_m);
        for round in 0..self.options.advanced.placement_rounds {
            let (mut h, mut g) = (Matrix3::zeros(), Vector3::zeros());
            for m in &self.measured {
                let q = rotation * self.model.points[m.point].at(&state.shape);
                let ray = self.camera.ray(&m.pixel);
                let depth = (q.z + t.z).max(NEAREST_M);
                let rows = [
                    (Vector3::new(1.0, 0.0, -ray.x), ray.x * q.z - q.x, self.camera.fx, m.variance.x),
                    (Vector3::new(0.0, 1.0, -ray.y), ray.y * q.z - q.y, self.camera.fy, m.variance.y),
                ];
                // Metre sigma of the pixel at this depth.
                let variance =
                    rows.map(|(_, _, f, v)| v * (depth / f).powi(2) + self.options.keypoint_sigma_m.powi(2));
                let s: f64 = (0..2).map(|k| (rows[k].0.dot(&t) - rows[k].1).powi(2) / variance[k]).sum();
                let robust = if round == 0 { 1.0 } else { self.options.kernel().weight(s) };
                for k in 0..2 {
                    let weight = robust / variance[k];
                    h += rows[k].0 * rows[k].0.transpose() * weight;
                    g += rows[k].0 * (rows[k].1 * weight);
                }
            }
            if let Some(road) = &self.road {
                let RoadPlane { up, height_m } = road.plane;
                let weight = 1.0 / road.height_sigma_at(t.z.max(1.0)).powi(2);
                h += up * up.transpose() * weight;
                g -= up * (height_m * weight);
            }
            t = h.cholesky()?.solve(&g);
            if !(t.z > NEAREST_M && t.z < self.options.advanced.farthest_m) {
                return None;
            }
        }
        Some(t)
    }

    /// Position below the median keypoint at a distance, on the road if that is known.
    pub fn position_at(&self, distance_m: f64) -> Vector3<f64> {
        let middle = |axis: usize| {
            let mut values: Vec<f64> = self.measured.iter().map(|m| m.pixel[axis]).collect();
            median(&mut values).unwrap_or(0.0)
        };
        let t = self.camera.ray(&Point2::new(middle(0), middle(1))) * distance_m;
        let over_road_m =
            self.road.map_or(self.options.advanced.body_centre_m, |r| r.plane.up.dot(&t) + r.plane.height_m);
        t - self.up() * over_road_m
    }

    /// Larger side of the measured keypoints' bounding box \[px\], for a first guess of the distance.
    pub fn span_px(&self) -> f64 {
        let (mut low, mut high) = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        for m in &self.measured {
            low = low.inf(&m.pixel.coords);
            high = high.sup(&m.pixel.coords);
        }
        (high - low).max()
    }
}
