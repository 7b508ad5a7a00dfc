//! Position and size of a vehicle from one box: the paper's equation (1) with the vehicle's size, its heading and the plane of
//! the frame, solved by Gauss–Newton with a covariance.
//!
//! State: position on the road (ahead, left), height of the road there over the plane, size. Measurements: up to four edges of the
//! box; truncated and occluded edges are one-sided constraints. Priors: size of the class or track, height of the road.

mod jacobian;
mod noise;
mod single_view;
#[cfg(test)]
mod tests;

use motorcade_geometry::PinholeCamera;
use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

use crate::box_fit::jacobian::{edge_by_point, edge_by_state};
use crate::box_fit::noise::edge_deviation_px;
use crate::ground::GroundFrame;
use crate::observed_box::ObservedBox;
use crate::options::BoxFitOptions;
use crate::outline::{extreme_points, upright_axes};

pub(crate) use noise::{edge_sigma_px, road_height_sigma_m};
pub use single_view::SingleView;

/// Step length at which the iteration ends \[m\].
const CONVERGED_M: f64 = 1e-3;
/// Halvings of a step that does not improve the fit, at most.
const HALVINGS: i32 = 6;

/// Camera, road and noise model of a fit.
#[derive(Clone, Copy)]
pub struct BoxFit<'a> {
    /// Camera.
    pub camera: &'a PinholeCamera,
    /// Road of the frame.
    pub ground: &'a GroundFrame,
    /// Noise model and limits.
    pub options: &'a BoxFitOptions,
}

/// Offset of a predicted edge from the measured one, and its standard deviation \[px\].
#[derive(Clone, Copy)]
struct EdgeOffset {
    px: f64,
    sigma_px: f64,
}

/// Normal equations of the edges and the road at a state.
struct Linearised {
    h: Matrix6<f64>,
    g: Vector6<f64>,
    g_by_heading: Vector6<f64>,
    g_by_road: Vector6<f64>,
    chi2: f64,
    cost: f64,
    /// Edges that count.
    edges: [Option<EdgeOffset>; 4],
    /// Height above the road there \[m\], and its weight \[1/m²\].
    height_m: f64,
    height_weight: f64,
}

impl Linearised {
    /// Objective of the steps, without the size prior: robust squared residuals of edges and road, with the standard deviations of `noise`. They depend
    /// on the state, and a step that makes them larger explains nothing better.
    fn objective(&self, noise: &Self, cauchy_scale: f64) -> f64 {
        let squared = cauchy_scale.powi(2);
        let one = |(own, held): (&Option<EdgeOffset>, &Option<EdgeOffset>)| {
            let own = (*own)?;
            let sigma_px = held.map_or(own.sigma_px, |held| held.sigma_px);
            Some(squared * ((own.px / sigma_px).powi(2) / squared).ln_1p())
        };
        let edges: f64 = self.edges.iter().zip(&noise.edges).filter_map(one).sum();
        edges + self.height_m.powi(2) * noise.height_weight
    }
}

impl BoxFit<'_> {
    /// Fits position and size for a heading (angle from straight ahead \[rad\]) and a size prior. `None` when too few edges are
    /// measured, or when no vehicle in front of the camera explains them.
    pub fn locate(&self, observed: &ObservedBox, heading_rad: f64, prior: &SizePrior) -> Option<SingleView> {
        self.locate_sized(observed, heading_rad, (&prior.mean, &prior.information()), None)
    }

    /// [`BoxFit::locate`] for a size of this mean and full information matrix (3×3) \[1/m²\]. An earlier fit of the box, with another size or heading,
    /// is a start that takes fewer steps.
    pub(crate) fn locate_sized(
        &self,
        observed: &ObservedBox,
        heading_rad: f64,
        size: (&Dimensions, &Matrix3<f64>),
        earlier: Option<&SingleView>,
    ) -> Option<SingleView> {
        if !observed.is_sufficient() {
            return None;
        }
        let from = |state: Vector6<f64>| self.locate_from(state, observed, heading_rad, size);
        earlier.and_then(|view| from(view.state)).or_else(|| from(self.initial_state(observed, size.0)?))
    }

    fn locate_from(
        &self,
        mut state: Vector6<f64>,
        observed: &ObservedBox,
        heading_rad: f64,
        (mean, size_information): (&Dimensions, &Matrix3<f64>),
    ) -> Option<SingleView> {
        let Self { ground, options, .. } = *self;
        let (axes, foot) = (ground.axes(), ground.foot());
        let rotation = upright_axes(&ground.direction_of(heading_rad), &ground.up);
        let mean = mean.to_vector();
        let size_error = |x: &Vector6<f64>| x.fixed_rows::<3>(3).into_owned() - mean;
        let objective = |edges: &Linearised, noise: &Linearised, x: &Vector6<f64>| {
            let of_size = size_error(x).dot(&(size_information * size_error(x)));
            edges.objective(noise, options.cauchy_scale) + of_size
        };
        let mut edges = self.linearise(observed, &state, &axes, &rotation)?;
        let mut remaining = options.iterations;
        let factor = loop {
            let (mut h, mut g) = (edges.h, edges.g);
            let mut block = h.fixed_view_mut::<3, 3>(3, 3);
            block += size_information;
            let mut rows = g.fixed_rows_mut::<3>(3);
            rows += size_information * size_error(&state);
            let factor = h.cholesky()?;
            let mut step = factor.solve(&-g);
            let limit = options.step_share * state[0];
            if step[0].abs() > limit {
                step *= limit / step[0].abs();
            }
            remaining = remaining.saturating_sub(1);
            if remaining == 0 || step.norm() < CONVERGED_M {
                break factor;
            }
            if state[0] + step[0] < options.nearest_m || step.iter().any(|v| !v.is_finite()) {
                return None;
            }
            // Hidden edges leave a direction almost free: a whole step may end far on the other side of the road.
            let before = objective(&edges, &edges, &state);
            let shortened = (0..=HALVINGS).map(|k| state + step * 0.5_f64.powi(k));
            let better = shortened.into_iter().find_map(|x| {
                let found = self.linearise(observed, &x, &axes, &rotation)?;
                (objective(&found, &edges, &x) <= before).then_some((x, found))
            });
            match better {
                Some(found) => (state, edges) = found,
                None => break factor,
            }
        };
        Some(SingleView {
            position_in_camera: Point3::from(foot + axes * state.fixed_rows::<3>(0)),
            covariance: axes * factor.inverse().fixed_view::<3, 3>(0, 0) * axes.transpose(),
            size: Dimensions::from_vector(&state.fixed_rows::<3>(3).into_owned()),
            chi2: edges.chi2,
            cost: edges.cost,
            information: edges.h,
            gradient: edges.g,
            state,
            gradient_by_heading: edges.g_by_heading,
            gradient_by_road: edges.g_by_road,
            axes,
        })
    }

    /// Normal equations of edges and road height in (ahead, left, above | l, w, h).
    fn linearise(
        &self,
        observed: &ObservedBox,
        x: &Vector6<f64>,
        axes: &Matrix3<f64>,
        rotation: &Matrix3<f64>,
    ) -> Option<Linearised> {
        let Self { camera, ground, options } = *self;
        let position = ground.foot() + axes * x.fixed_rows::<3>(0);
        let size = x.fixed_rows::<3>(3).into_owned();
        let outline = (observed.class, observed.convention);
        let predicted = extreme_points(camera, rotation, &position, outline, &size)?;
        let measured = observed.bbox.to_array();
        let (mut h, mut g) = (Matrix6::zeros(), Vector6::zeros());
        let (mut chi2, mut cost) = (0.0, 0.0);
        let mut edges = [None; 4];
        let mut g_by_heading = Vector6::zeros();
        for edge in 0..4 {
            let offset_px = predicted[edge].pixel - measured[edge];
            let Some(s) = edge_deviation_px(camera, observed, edge, offset_px, options) else { continue };
            let r = offset_px / s;
            let softened = 1.0 + r * r / options.cauchy_scale.powi(2);
            let w = 1.0 / softened;
            let j = edge_by_state(camera, edge, &predicted[edge], axes, rotation) / s;
            // Derivative of the extreme point by the heading: up × (X − position).
            let turned = ground.up.cross(&(predicted[edge].point.coords - position));
            let by_heading = edge_by_point(camera, edge, &predicted[edge].point) * turned / s * w;
            let j = j.transpose();
            g_by_heading += j * by_heading;
            h.ger(w, &j, &j, 1.0);
            g += j * (r * w);
            chi2 += r * r;
            cost += options.cauchy_scale.powi(2) * softened.ln() + 2.0 * s.ln();
            edges[edge] = Some(EdgeOffset { px: offset_px, sigma_px: s });
        }
        let height_weight = 1.0 / road_height_sigma_m(ground, x[0], x[1], options).powi(2);
        let (rise_m, slope) = ground.rise(x[0]);
        let height_m = x[2] - rise_m;
        cost += height_m * height_m * height_weight - height_weight.ln();
        let by_state = Vector6::new(-slope, 0.0, 1.0, 0.0, 0.0, 0.0);
        h.ger(height_weight, &by_state, &by_state, 1.0);
        g += by_state * (height_weight * height_m);
        let g_by_road = -by_state * height_weight;
        Some(Linearised { h, g, g_by_heading, g_by_road, chi2, cost, edges, height_m, height_weight })
    }

    /// Equation (1) at the bottom edge, or depth from the vehicle's height where that edge is not measured; size at its mean.
    fn initial_state(&self, observed: &ObservedBox, mean: &Dimensions) -> Option<Vector6<f64>> {
        let Self { camera, ground, options } = *self;
        let b = &observed.bbox;
        let centre = camera.ray(&nalgebra::Point2::new(0.5 * (b.x1 + b.x2), b.y2));
        let on_road = -ground.up.dot(&centre) / ground.height_m; // (1)
        let by_height = b.height() / (camera.fy * mean.height_m);
        let inverse_depth =
            if observed.edges[3] && on_road > options.horizon_m.recip() { on_road } else { by_height };
        let [nearest, farthest] = options.start_depths_m;
        let depth = 1.0 / inverse_depth.min(nearest.recip()).max(farthest.recip());
        let point: Vector3<f64> = centre * depth - ground.foot();
        let size = mean.to_vector();
        // The bottom edge belongs to the rear tyres.
        let ahead = point.dot(&ground.ahead()) + options.rear_tyres_share * size.x;
        let left = point.dot(&ground.left());
        (ahead > options.nearest_m)
            .then(|| Vector6::new(ahead.max(options.nearest_start_m), left, 0.0, size.x, size.y, size.z))
    }
}
