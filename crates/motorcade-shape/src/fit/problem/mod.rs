//! The cost of a pose and a shape (equations 7 and 8 of the paper, and what we add), as whitened residuals with analytic
//! Jacobians.
//!
//! ```text
//! Σ_i ρ( c_i |π(R X_i(λ) + t) − x_i|²_Σi )     keypoints, c_i the confidence          (7, 8)
//! + Σ_b λ_b² / variance_b                      shape prior
//! + ((up·t + h)/σ_h)² + |lean|²/σ²             the vehicle stands on the road, upright
//! + |size(λ) − mean|²_Σ                        size of the class
//! + Σ_e ρ(((edge_e − seen_e)/σ)²)              edges of the image box, when given
//! + Σ_i ρ_v(hidden yet seen, facing yet unseen) visibility
//! ```
//!
//! Tangent of a state: `[ω, ν, shape]`, the pose's part on the right, the shape whitened.

use motorcade_geometry::lie::so3::hat;
use motorcade_geometry::robust::{Kernel, median};
use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use nalgebra::{Matrix3, Point2, RowVector3, SMatrix, SVector, Vector2, Vector3};

use super::model::{Model, State};
use super::observation::{ImageBox, Observation, RoadPlane};
use super::options::FitOptions;
use super::{DOF, MAX_SHAPE};
use crate::dimensions::SizePrior;
use crate::view::facing;

/// Closer points have no meaningful image \[m\].
const NEAREST_M: f64 = 0.5;
/// Width of the transition from hidden to visible in the cosine of a face.
const VISIBILITY_SIGMA: f64 = 0.2;
/// −2 ln of how often a point that faces the camera goes unseen (occlusion, darkness: 30 %).
const UNSEEN_COST: f64 = 2.4;
/// −2 ln of how often a point on a face turned away is "seen" (3 %).
const SEEN_HIDDEN_COST: f64 = 7.0;
/// Points of the 14 point layout, to which the costs of visibility are tuned; denser points are not independent.
const VISIBILITY_POINTS: f64 = 14.0;

/// What a residual belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Term {
    /// Keypoint (its place in the observation); two rows each, x then y.
    Keypoint(usize),
    /// Saturates at the given cost.
    Visibility(f64),
    /// An edge of the image box.
    BoxEdge,
    /// Height over the road, lean.
    Road,
    /// Size of the class.
    Size,
    /// Shape prior.
    Shape,
}

impl Term {
    /// True for what is measured in the image rather than known before.
    pub fn is_image(self) -> bool {
        matches!(self, Self::Keypoint(_) | Self::BoxEdge | Self::Visibility(_))
    }
}

/// A whitened residual and its slope in `[ω, ν, shape]` (1×14).
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub term: Term,
    pub r: f64,
    pub j: SVector<f64, DOF>,
}

/// A measured keypoint.
#[derive(Clone, Copy, Debug)]
struct Measured {
    /// Index in the observation.
    seen: usize,
    /// Index in the model: another one when sides are swapped.
    point: usize,
    pixel: Point2<f64>,
    /// Variance along x and y, confidence included \[px²\].
    variance: Vector2<f64>,
}

/// One vehicle in one image, for one assignment of sides.
pub(crate) struct Problem<'a> {
    pub model: &'a Model,
    pub camera: &'a PinholeCamera,
    pub options: &'a FitOptions,
    measured: Vec<Measured>,
    unseen: Vec<usize>,
    road: Option<RoadPlane>,
    image_box: Option<ImageBox>,
    size: Option<SizePrior>,
    /// Distance at which metre sigmas are turned into pixels; held while a refinement runs, or going far would be cheap.
    pub distance_m: f64,
    /// Whether shape prior and size count here; in a track they count once, not in every frame.
    pub shape_terms: bool,
}

impl<'a> Problem<'a> {
    pub fn new(
        model: &'a Model,
        camera: &'a PinholeCamera,
        options: &'a FitOptions,
        observation: &Observation,
        swapped: bool,
    ) -> Self {
        let (mut measured, mut unseen) = (Vec::new(), Vec::new());
        for (seen, keypoint) in observation.keypoints.iter().enumerate() {
            let point = if swapped { model.mirror[seen] } else { seen };
            if keypoint.confidence >= options.min_confidence {
                // Measured errors grow as the root of 1/confidence (3, 4, 6 px of 64 at 0.7, 0.4, 0.2): the
                // confidence is the weight, as in the paper.
                let variance = observation.sigma_px.map(|s| s * s / keypoint.confidence);
                measured.push(Measured { seen, point, pixel: keypoint.pixel, variance });
            } else {
                unseen.push(point);
            }
        }
        Self {
            model,
            camera,
            options,
            measured,
            unseen,
            road: observation.road,
            image_box: observation.image_box.filter(|_| model.has_outline()),
            size: observation.size,
            distance_m: 15.0,
            shape_terms: true,
        }
    }

    /// The direction away from the road (camera frame).
    pub fn up(&self) -> Vector3<f64> {
        self.road.map_or_else(|| -Vector3::y(), |r| r.up)
    }

    /// Whitened rows of all residuals at a state; false when a keypoint lies behind the camera.
    pub fn rows(&self, state: &State, rows: &mut Vec<Row>) -> bool {
        rows.clear();
        let pose = &state.camera_from_vehicle;
        let (rotation, translation) = (pose.rotation_matrix(), pose.translation());
        let ok = self.keypoint_rows(state, &rotation, &translation, rows)
            && self.box_rows(state, &rotation, &translation, rows);
        self.visibility_rows(state, &rotation, rows);
        self.road_rows(&rotation, &translation, rows);
        if self.shape_terms {
            self.shape_rows(state, rows);
        }
        ok && translation.z > NEAREST_M
    }

    /// Kernel of a term: cost ρ(s) and weight ρ'(s) of a squared whitened residual.
    pub fn robust(&self, term: Term, s: f64) -> (f64, f64) {
        match term {
            Term::Keypoint(_) => (self.options.kernel.cost(s), self.options.kernel.weight(s)),
            // Geman–McClure: whatever happens, a single point's visibility costs no more than its surprise.
            Term::Visibility(most) => (most * s / (1.0 + s), most / (1.0 + s).powi(2)),
            Term::BoxEdge => (Kernel::Cauchy(2.0).cost(s), Kernel::Cauchy(2.0).weight(s)),
            Term::Road | Term::Size | Term::Shape => (s, 1.0),
        }
    }

    /// Image of a model point and its slope (2×14) \[px\]; `None` behind the camera.
    fn image(
        &self,
        point: usize,
        state: &State,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, SMatrix<f64, 2, DOF>)> {
        let model_point = &self.model.points[point];
        let in_vehicle = model_point.at(&state.shape);
        let p = rotation * in_vehicle + translation;
        if p.z < NEAREST_M {
            return None;
        }
        let (iz, c) = (1.0 / p.z, self.camera);
        let pixel = Vector2::new(c.fx * p.x * iz + c.cx, c.fy * p.y * iz + c.cy);
        // ∂u/∂p (2×3), ∂p/∂[ω, ν, shape] = R [−X^, I, V] (3×14)
        let du_dp = [[c.fx * iz, -c.fx * p.x * iz * iz], [c.fy * iz, -c.fy * p.y * iz * iz]];
        let mut j = SMatrix::<f64, 2, DOF>::zeros();
        for axis in 0..2 {
            // A row of ∂u/∂X; times X^ it is the cross product with X.
            let by_x: RowVector3<f64> =
                rotation.row(axis) * du_dp[axis][0] + rotation.row(2) * du_dp[axis][1];
            let by_turn = in_vehicle.transpose().cross(&by_x);
            for k in 0..3 {
                (j[(axis, k)], j[(axis, 3 + k)]) = (by_turn[k], by_x[k]);
            }
            for b in 0..MAX_SHAPE {
                let v = &model_point.basis;
                j[(axis, 6 + b)] = by_x[0] * v[(0, b)] + by_x[1] * v[(1, b)] + by_x[2] * v[(2, b)];
            }
        }
        Some((pixel, j))
    }

    fn keypoint_rows(
        &self,
        state: &State,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
        rows: &mut Vec<Row>,
    ) -> bool {
        let spread_px =
            Vector2::new(self.camera.fx, self.camera.fy) * (self.options.keypoint_sigma_m / self.distance_m);
        for m in &self.measured {
            let Some((pixel, j)) = self.image(m.point, state, rotation, translation) else { return false };
            for axis in 0..2 {
                let weight = 1.0 / (m.variance[axis] + spread_px[axis].powi(2)).sqrt();
                rows.push(Row {
                    term: Term::Keypoint(m.seen),
                    r: (pixel[axis] - m.pixel[axis]) * weight,
                    j: j.row(axis).transpose() * weight,
                });
            }
        }
        true
    }

    /// The box ends where the outermost point of keypoints and outline lies.
    fn box_rows(
        &self,
        state: &State,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
        rows: &mut Vec<Row>,
    ) -> bool {
        let Some(seen) = &self.image_box else { return true };
        let mut extreme = [(f64::MAX, 0), (f64::MAX, 0), (f64::MIN, 0), (f64::MIN, 0)];
        for (index, point) in self.model.points.iter().enumerate() {
            let p = rotation * point.at(&state.shape) + translation;
            if p.z < NEAREST_M {
                return false;
            }
            let pixel =
                [self.camera.fx * p.x / p.z + self.camera.cx, self.camera.fy * p.y / p.z + self.camera.cy];
            for axis in 0..2 {
                if pixel[axis] < extreme[axis].0 {
                    extreme[axis] = (pixel[axis], index);
                }
                if pixel[axis] > extreme[axis + 2].0 {
                    extreme[axis + 2] = (pixel[axis], index);
                }
            }
        }
        for edge in (0..4).filter(|e| seen.trusted[*e]) {
            let (value, index) = extreme[edge];
            let Some((_, j)) = self.image(index, state, rotation, translation) else { return false };
            let weight = 1.0 / seen.sigma_px(edge);
            rows.push(Row {
                term: Term::BoxEdge,
                r: (value - seen.edges_px[edge]) * weight,
                j: j.row(edge % 2).transpose() * weight,
            });
        }
        true
    }

    fn visibility_rows(&self, state: &State, rotation: &Matrix3<f64>, rows: &mut Vec<Row>) {
        if !self.options.visibility {
            return;
        }
        let share = (VISIBILITY_POINTS / self.model.keypoints as f64).min(1.0);
        let camera_in_vehicle = -(rotation.transpose() * state.camera_from_vehicle.translation());
        let mut push = |point: usize, seen: bool| {
            let to_camera = camera_in_vehicle - self.model.points[point].at(&state.shape);
            let (cosine, Some(face)) = facing(&self.model.faces[point], &to_camera) else { return };
            // Positive where it surprises.
            let r = if seen { -cosine } else { cosine } / VISIBILITY_SIGMA;
            if r <= 0.0 {
                return;
            }
            // With o the camera in the vehicle and v the unit vector from the point X to it:
            // ∂c/∂o = −∂c/∂X = nᵀ(I − v vᵀ)/|o − X|, ∂o/∂[ω, ν] = [o^, −I], ∂X/∂shape = V.
            let distance = to_camera.norm();
            let v = to_camera / distance;
            let dc_do: RowVector3<f64> = (face - v * v.dot(&face)).transpose() / distance;
            let slope = if seen { -1.0 } else { 1.0 } / VISIBILITY_SIGMA;
            let mut j = SVector::<f64, DOF>::zeros();
            j.fixed_rows_mut::<3>(0).copy_from(&((dc_do * hat(&camera_in_vehicle)).transpose() * slope));
            j.fixed_rows_mut::<3>(3).copy_from(&(-dc_do.transpose() * slope));
            let by_shape = -dc_do * self.model.points[point].basis * slope;
            j.fixed_rows_mut::<MAX_SHAPE>(6).copy_from(&by_shape.transpose());
            let most = if seen { SEEN_HIDDEN_COST } else { UNSEEN_COST } * share;
            rows.push(Row { term: Term::Visibility(most), r, j });
        };
        self.measured.iter().for_each(|m| push(m.point, true));
        for point in &self.unseen {
            // A point out of the image cannot be seen, whatever it faces.
            let p =
                state.camera_from_vehicle.transform_point(&self.model.points[*point].at(&state.shape).into());
            if self.camera.project(&p).is_some_and(|pixel| self.camera.contains(&pixel, 0.0)) {
                push(*point, false);
            }
        }
    }

    fn road_rows(&self, rotation: &Matrix3<f64>, translation: &Vector3<f64>, rows: &mut Vec<Row>) {
        let up = self.up();
        if let Some(road) = &self.road {
            let weight = 1.0 / road.height_sigma_at(self.distance_m);
            let mut j = SVector::<f64, DOF>::zeros();
            j.fixed_rows_mut::<3>(3).copy_from(&(rotation.transpose() * up * weight));
            rows.push(Row { term: Term::Road, r: (up.dot(translation) + road.height_m) * weight, j });
        }
        let sigma = self.road.map_or(self.options.level_sigma_rad, |r| r.lean_sigma_rad());
        // u = Rᵀ up is (0, 0, 1) for an upright vehicle; ∂u/∂ω = u^.
        let u = rotation.transpose() * up;
        let du = hat(&u);
        for axis in 0..2 {
            let mut j = SVector::<f64, DOF>::zeros();
            j.fixed_rows_mut::<3>(0).copy_from(&(du.row(axis).transpose() / sigma));
            rows.push(Row { term: Term::Road, r: u[axis] / sigma, j });
        }
    }

    pub fn shape_rows(&self, state: &State, rows: &mut Vec<Row>) {
        for b in 0..self.model.sigmas.len() {
            let mut j = SVector::<f64, DOF>::zeros();
            j[6 + b] = 1.0;
            rows.push(Row { term: Term::Shape, r: state.shape[b], j });
        }
        let Some(size) = &self.size else { return };
        let (mean, sigma) = (size.mean.to_vector(), size.sigma.to_vector());
        let found = self.model.size_mean + self.model.size_slope * state.shape;
        for axis in 0..3 {
            let mut j = SVector::<f64, DOF>::zeros();
            let slope = self.model.size_slope.row(axis).transpose() / sigma[axis];
            j.fixed_rows_mut::<MAX_SHAPE>(6).copy_from(&slope);
            rows.push(Row { term: Term::Size, r: (found[axis] - mean[axis]) / sigma[axis], j });
        }
    }

    /// The translation that best puts points of known orientation and shape on their rays and on the road: linear in t,
    ///
    /// ```text
    /// (R X + t)_x − x (R X + t)_z = 0,   (R X + t)_y − y (R X + t)_z = 0,   up·t = −h
    /// ```
    ///
    /// for rays (x, y, 1), reweighted a few times against outliers.
    pub fn linear_translation(&self, rotation: &Matrix3<f64>, state: &State) -> Option<Vector3<f64>> {
        const ROUNDS: usize = 4;
        let mut t = Vector3::new(0.0, 0.0, self.distance_m);
        for round in 0..ROUNDS {
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
                let robust = if round == 0 { 1.0 } else { self.options.kernel.weight(s) };
                for k in 0..2 {
                    let weight = robust / variance[k];
                    h += rows[k].0 * rows[k].0.transpose() * weight;
                    g += rows[k].0 * (rows[k].1 * weight);
                }
            }
            if let Some(road) = &self.road {
                let weight = 1.0 / road.height_sigma_at(t.z.max(1.0)).powi(2);
                h += road.up * road.up.transpose() * weight;
                g -= road.up * (road.height_m * weight);
            }
            t = h.cholesky()?.solve(&g);
            if !(t.z > NEAREST_M && t.z < 500.0) {
                return None;
            }
        }
        Some(t)
    }

    /// The road (or else the middle of a body) under the median keypoint, at a distance.
    pub fn place_at(&self, distance_m: f64) -> Vector3<f64> {
        let middle = |axis: usize| {
            let mut values: Vec<f64> = self.measured.iter().map(|m| m.pixel[axis]).collect();
            median(&mut values).unwrap_or(0.0)
        };
        let t = self.camera.ray(&Point2::new(middle(0), middle(1))) * distance_m;
        let over_road_m = self.road.map_or(0.8, |r| r.up.dot(&t) + r.height_m);
        t - self.up() * over_road_m
    }

    /// Height of the measured keypoints' bundle \[px\], for a first guess of the distance.
    pub fn span_px(&self) -> f64 {
        let (mut low, mut high) = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        for m in &self.measured {
            low = low.inf(&m.pixel.coords);
            high = high.sup(&m.pixel.coords);
        }
        (high - low).max()
    }
}

/// A pose from an orientation and a place.
pub(crate) fn pose(rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Pose<Camera, Vehicle> {
    Pose::from_matrix(rotation, translation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimensions::{Dimensions, SizePrior};
    use crate::fit::ObservedKeypoint;
    use crate::keypoint::Layout;
    use crate::prior::ShapePrior;

    /// Every row's slope against central differences, at a state where all terms are at work.
    #[test]
    fn analytic_jacobians_match_differences() {
        let camera = PinholeCamera { fx: 720.0, fy: 700.0, cx: 620.0, cy: 180.0, width: 1242, height: 375 };
        for (layout, heading) in [(Layout::Car36, 0.3_f64), (Layout::Car14, 2.2), (Layout::Car14, -1.2)] {
            let model = Model::new(&ShapePrior::of_family(layout), MAX_SHAPE);
            let options = FitOptions::default();
            let (s, c) = heading.sin_cos();
            let rotation =
                Matrix3::from_columns(&[Vector3::new(-s, 0.1, c), Vector3::new(-c, 0.0, -s), -Vector3::y()]);
            let shape = SVector::from_fn(|b, _| 0.3 - 0.1 * b as f64);
            let state = State { camera_from_vehicle: pose(&rotation, &Vector3::new(2.0, 1.5, 11.0)), shape };
            // Pixels off the projections, every third point unseen.
            let keypoints = (0..layout.count())
                .map(|i| ObservedKeypoint {
                    pixel: Point2::new(700.0 + 9.0 * i as f64, 200.0 + 4.0 * (i % 5) as f64),
                    confidence: if i % 3 == 0 { 0.0 } else { 0.5 },
                })
                .collect();
            let mut observation = Observation::new(keypoints, 2.0);
            observation.image_box = Some(ImageBox::new([600.0, 150.0, 900.0, 290.0], &camera));
            observation.road = Some(RoadPlane::level(1.6));
            observation.size = Some(SizePrior {
                mean: Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 },
                sigma: Dimensions { length_m: 0.4, width_m: 0.1, height_m: 0.1 },
            });
            let problem = Problem::new(&model, &camera, &options, &observation, false);
            let at = |state: &State| {
                let mut rows = Vec::new();
                assert!(problem.rows(state, &mut rows));
                rows
            };
            let rows = at(&state);
            for wanted in [Term::Keypoint(1), Term::BoxEdge, Term::Road, Term::Size, Term::Shape] {
                assert!(rows.iter().any(|r| r.term == wanted), "{wanted:?}");
            }
            assert!(rows.iter().any(|r| matches!(r.term, Term::Visibility(_))));
            let h = 1e-6;
            for k in 0..DOF {
                let (plus, minus) = (moved(&state, k, h), moved(&state, k, -h));
                for ((row, a), b) in rows.iter().zip(at(&plus)).zip(at(&minus)) {
                    let numeric = (a.r - b.r) / (2.0 * h);
                    let scale = 1.0 + numeric.abs();
                    assert!((row.j[k] - numeric).abs() < 1e-5 * scale, "{:?} {k}: {numeric}", row.term);
                }
            }
        }
    }

    fn moved(state: &State, k: usize, h: f64) -> State {
        let mut step = SVector::<f64, DOF>::zeros();
        step[k] = h;
        State {
            camera_from_vehicle: state.camera_from_vehicle.retract(&step.fixed_rows::<6>(0).into_owned()),
            shape: state.shape + step.fixed_rows::<MAX_SHAPE>(6),
        }
    }
}
