//! Where a vehicle stands, from one box: the paper's equation (1) done with the vehicle's size, heading and the plane of
//! the frame, and with a covariance.
//!
//! Unknown: place on the road (ahead, left), height of the road there over the plane, size. Known: up to four edges of
//! the box. Priors: size of the class (or track), road height. Solved by Gauss–Newton; edges that are cut off by the
//! image or hidden behind another vehicle are bounds, which the vehicle reaches or passes.

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
use nalgebra::{Matrix3, Matrix6, Point3, RowVector3, RowVector6, Vector3, Vector6};

use crate::ground::GroundFrame;
use crate::silhouette::{Touching, standing_pose, touching};
use motorcade_shape::{Dimensions, SizePrior};

/// A box that ends nearer to the image's border is cut off by it \[px\].
const BORDER_PX: f64 = 3.0;

/// A box and which of its edges are the vehicle's own: left, top, right, bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedBox {
    /// The box \[px\].
    pub bbox: BoundingBox,
    /// Kind of vehicle.
    pub class: VehicleClass,
    /// Convention of the box.
    pub convention: BoxConvention,
    /// Trustworthy edges.
    pub edges: [bool; 4],
}

impl ObservedBox {
    /// Judges the edges: cut off where the box meets the image border, hidden where a nearer box (with a lower bottom edge)
    /// covers most of the edge. Corners are drawn where they are, hidden or not.
    pub fn new(detection: &Detection, camera: &PinholeCamera, others: &[BoundingBox]) -> Self {
        const COVERED: f64 = 0.4;
        let Detection { bbox, class, convention, .. } = *detection;
        let (right, bottom) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
        let mut edges = [
            bbox.x1 > BORDER_PX,
            bbox.y1 > BORDER_PX,
            bbox.x2 < right - BORDER_PX,
            bbox.y2 < bottom - BORDER_PX,
        ];
        let hidden = |o: &&BoundingBox| {
            convention == BoxConvention::VisibleExtent && **o != bbox && o.y2 > bbox.y2 + 1.0
        };
        for other in others.iter().filter(hidden) {
            let (w, h) = (bbox.width().max(1.0), bbox.height().max(1.0));
            let across = (bbox.x2.min(other.x2) - bbox.x1.max(other.x1)) / w;
            let down = (bbox.y2.min(other.y2) - bbox.y1.max(other.y1)) / h;
            let holds = |v: f64, low: f64, high: f64| v > low && v < high;
            edges[0] &= !(down > COVERED && holds(bbox.x1, other.x1 - 1.0, other.x2));
            edges[2] &= !(down > COVERED && holds(bbox.x2, other.x1, other.x2 + 1.0));
            edges[3] &= !(across > COVERED && holds(bbox.y2, other.y1, other.y2));
        }
        Self { bbox, class, convention, edges }
    }

    /// True for a box whose height is that of a part: of a car that the left or right border cuts off a bonnet or a boot is
    /// seen. Lorries, buses and vans are as high all along.
    fn is_of_a_part(&self, camera: &PinholeCamera) -> bool {
        let cut = self.bbox.x1 <= BORDER_PX || self.bbox.x2 >= f64::from(camera.width) - 1.0 - BORDER_PX;
        cut && self.class == VehicleClass::Car && self.convention == BoxConvention::VisibleExtent
    }

    /// False for a box of which too little is seen to place a vehicle.
    pub(crate) fn tells(&self) -> bool {
        let [_, top, _, bottom] = self.edges;
        self.edges.iter().filter(|e| **e).count() >= 2 && (top || bottom)
    }
}

/// A vehicle's place and size from one box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleView {
    /// Bottom centre, camera frame \[m\].
    pub position_in_camera: Point3<f64>,
    /// Covariance of the position (3×3, camera frame) \[m²\].
    pub covariance: Matrix3<f64>,
    /// Size.
    pub size: Dimensions,
    /// Weighted squared residual of the edges.
    pub chi2: f64,
    /// Normal equations in (ahead, left, above | l, w, h) without the size prior, for joining the frames of a track.
    pub(crate) information: Matrix6<f64>,
    pub(crate) gradient: Vector6<f64>,
    pub(crate) state: Vector6<f64>,
    /// Derivative of the gradient by the heading.
    by_heading: Vector6<f64>,
    /// Camera-frame directions of (ahead, left, above).
    axes: Matrix3<f64>,
}

impl SingleView {
    /// χ² of the edges, and of the size against what was known of it.
    pub(crate) fn misfit(&self, prior: &SizePrior) -> f64 {
        let off = self.size.to_vector() - prior.mean.to_vector();
        self.chi2 + off.component_div(&prior.sigma.to_vector()).norm_squared()
    }

    /// How the place depends on the mean of the size it was found with: by the implicit function theorem on the normal equations,
    /// with the prior's information W,
    ///
    /// ```text
    /// H = [H_pp, H_ps; H_sp, H_ss + W]     ∂place/∂mean = (H⁻¹)_ps W  (→ −H_pp⁻¹ H_ps for a size that is held)
    /// ```
    pub(crate) fn by_mean_size(&self, size_information: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        let inverse = self.inverse(size_information)?;
        Some(self.axes * inverse.fixed_view::<3, 3>(0, 3) * size_information)
    }

    /// How the place depends on the heading it was found with (camera frame, m per rad): −(H⁻¹ ∂g/∂heading)_p, H as above.
    /// A vehicle that is turned further shows more of its side, and as wide a box stands further away: half a metre for 3° at 18 m.
    pub(crate) fn by_heading(&self, size_information: &Matrix3<f64>) -> Option<Vector3<f64>> {
        let slope = self.inverse(size_information)? * self.by_heading;
        Some(self.axes * -slope.fixed_rows::<3>(0))
    }

    fn inverse(&self, size_information: &Matrix3<f64>) -> Option<Matrix6<f64>> {
        let mut h = self.information;
        let mut block = h.fixed_view_mut::<3, 3>(3, 3);
        block += size_information;
        Some(h.cholesky()?.inverse())
    }
}

/// Standard deviation of a detector's edge \[px\]: a floor, and a share of the box for its habits (mirrors, shadows).
fn edge_sigma_px(bbox: &BoundingBox, edge: usize) -> f64 {
    let side = if edge.is_multiple_of(2) { bbox.width() } else { bbox.height() };
    (1.2_f64.powi(2) + (0.025 * side).powi(2)).sqrt()
}

/// Standard deviation of an edge for a vehicle that ends `off` further right or down \[px\]; `None` where it says nothing.
///
/// What is cut off or hidden reaches at least as far as what is seen, to which it is held less firmly than a vehicle that is seen
/// ends at its edge. Where something hides its bottom it seldom reaches much further: that keeps its depth within bounds, which its
/// roof, at the camera's own height, would not. The whole of which only a part is seen may be higher and stand lower.
fn deviation_px(camera: &PinholeCamera, seen: &ObservedBox, edge: usize, off: f64) -> Option<f64> {
    const HIDDEN: f64 = 3.0;
    /// As shares of the height that is seen.
    const BEYOND: f64 = 0.3;
    const PART: f64 = 0.15;
    let hidden = edge == 3 && seen.bbox.y2 < f64::from(camera.height) - 1.0 - BORDER_PX;
    let reaches = if edge < 2 { off <= 0.0 } else { off >= 0.0 };
    match (seen.edges[edge], reaches) {
        (true, true) if !edge.is_multiple_of(2) && seen.is_of_a_part(camera) => {
            Some(edge_sigma_px(&seen.bbox, edge).hypot(PART * seen.bbox.height()))
        }
        (true, _) => Some(edge_sigma_px(&seen.bbox, edge)),
        (false, false) => Some(HIDDEN * edge_sigma_px(&seen.bbox, edge)),
        (false, true) => hidden.then(|| BEYOND * seen.bbox.height()),
    }
}

/// Standard deviation of the road's height at a distance over the plane below the camera \[m\]: the plane's own pitch, and
/// the road's change of slope (vertical curves of streets: about 0.2° over 20 m).
fn road_height_sigma_m(ground: &GroundFrame, ahead_m: f64) -> f64 {
    let slope = 0.2_f64.to_radians() * (ahead_m / 20.0).min(3.0);
    let pitch = ground.pitch_sigma_rad.hypot(slope);
    0.02_f64.hypot(pitch * ahead_m)
}

/// Fits place and size for a heading (angle from straight ahead \[rad\]) and a size prior. `None` with fewer than two
/// edges, or when no vehicle in front of the camera explains them.
pub fn locate(
    camera: &PinholeCamera,
    ground: &GroundFrame,
    seen: &ObservedBox,
    heading_rad: f64,
    prior: &SizePrior,
) -> Option<SingleView> {
    let information = Matrix3::from_diagonal(&prior.sigma.to_vector().map(|s| 1.0 / (s * s)));
    locate_sized(camera, ground, seen, heading_rad, &prior.mean, &information)
}

/// The same for a size known with an information (3×3) \[1/m²\].
pub(crate) fn locate_sized(
    camera: &PinholeCamera,
    ground: &GroundFrame,
    seen: &ObservedBox,
    heading_rad: f64,
    mean: &Dimensions,
    size_information: &Matrix3<f64>,
) -> Option<SingleView> {
    if !seen.tells() {
        return None;
    }
    let measured = seen.bbox.to_array();
    let (axes, foot) = (axes(ground), ground.foot());
    let rotation =
        standing_pose(&Point3::origin(), &ground.direction_of(heading_rad), &ground.up).rotation_matrix();
    let mut x = start(camera, ground, seen, mean)?;
    let mean = mean.to_vector();
    let mut last = None;
    for _ in 0..12 {
        let (place, size) = (foot + axes * x.fixed_rows::<3>(0), x.fixed_rows::<3>(3).into_owned());
        let at = touching(camera, &rotation, &place, (seen.class, seen.convention), &size)?;
        let (mut h, mut g, mut chi2) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        let mut by_heading = Vector6::zeros();
        for edge in 0..4 {
            let off = at[edge].pixel - measured[edge];
            let Some(s) = deviation_px(camera, seen, edge, off) else { continue };
            let r = off / s;
            // Cauchy with three sigma: a box jumps now and then.
            let w = 1.0 / (1.0 + r * r / 9.0);
            let j = derivative(camera, edge, &at[edge], &axes, &rotation) / s;
            let turned = ground.up.cross(&(at[edge].point.coords - place));
            by_heading += j.transpose() * (by_point(camera, edge, &at[edge].point) * turned / s * w);
            h += j.transpose() * j * w;
            g += j.transpose() * (r * w);
            chi2 += r * r;
        }
        let height_weight = 1.0 / road_height_sigma_m(ground, x[0]).powi(2);
        h[(2, 2)] += height_weight;
        g[2] += height_weight * x[2];
        let (information, gradient) = (h, g);
        let mut block = h.fixed_view_mut::<3, 3>(3, 3);
        block += size_information;
        let mut rows = g.fixed_rows_mut::<3>(3);
        rows += size_information * (size - mean);
        let factor = h.cholesky()?;
        let mut step = factor.solve(&-g);
        last = Some((x, factor, (information, gradient, by_heading), chi2));
        // Far away the image is almost flat in depth: no more than a third of the distance at once.
        let limit = 0.33 * x[0];
        if step[0].abs() > limit {
            step *= limit / step[0].abs();
        }
        if step.norm() < 1e-5 {
            break;
        }
        x += step;
        if x[0] < 1.0 || x.iter().any(|v| !v.is_finite()) {
            return None;
        }
    }
    let (state, factor, (information, gradient, by_heading), chi2) = last?;
    Some(SingleView {
        position_in_camera: Point3::from(foot + axes * state.fixed_rows::<3>(0)),
        covariance: axes * factor.inverse().fixed_view::<3, 3>(0, 0) * axes.transpose(),
        size: Dimensions::from_vector(&state.fixed_rows::<3>(3).into_owned()),
        chi2,
        information,
        gradient,
        state,
        by_heading,
        axes,
    })
}

/// Camera-frame directions of (ahead, left, above).
fn axes(ground: &GroundFrame) -> Matrix3<f64> {
    Matrix3::from_columns(&[ground.ahead(), ground.left(), ground.up])
}

fn start(
    camera: &PinholeCamera,
    ground: &GroundFrame,
    seen: &ObservedBox,
    mean: &Dimensions,
) -> Option<Vector6<f64>> {
    let b = &seen.bbox;
    let centre = camera.ray(&nalgebra::Point2::new(0.5 * (b.x1 + b.x2), b.y2));
    // Equation (1): where the ray through the bottom edge meets the road; else depth from the vehicle's height.
    let on_road = -ground.up.dot(&centre) / ground.height_m;
    let by_height = b.height() / (camera.fy * mean.height_m);
    let inverse_depth = if seen.edges[3] && on_road > 0.005 { on_road } else { by_height };
    let depth = 1.0 / inverse_depth.clamp(0.004, 0.5);
    let point: Vector3<f64> = centre * depth - ground.foot();
    let size = mean.to_vector();
    let ahead = point.dot(&ground.ahead()) + 0.25 * size.x;
    (ahead > 1.0)
        .then(|| Vector6::new(ahead.max(3.0), point.dot(&ground.left()), 0.0, size.x, size.y, size.z))
}

/// Derivative of an edge by (ahead, left, above | l, w, h), 1×6: that of the point it touches.
fn derivative(
    camera: &PinholeCamera,
    edge: usize,
    at: &Touching,
    axes: &Matrix3<f64>,
    rotation: &Matrix3<f64>,
) -> RowVector6<f64> {
    let by_point = by_point(camera, edge, &at.point);
    let (by_place, by_body) = (by_point * axes, by_point * rotation);
    let f = &at.fractions;
    RowVector6::new(by_place.x, by_place.y, by_place.z, by_body.x * f.x, by_body.y * f.y, by_body.z * f.z)
}

/// Derivative of an edge by the point it touches (camera frame), 1×3 \[px/m\].
fn by_point(camera: &PinholeCamera, edge: usize, p: &Point3<f64>) -> RowVector3<f64> {
    if edge.is_multiple_of(2) {
        RowVector3::new(1.0, 0.0, -p.x / p.z) * (camera.fx / p.z)
    } else {
        RowVector3::new(0.0, 1.0, -p.y / p.z) * (camera.fy / p.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silhouette::image_box;
    use crate::size::size_prior;
    use motorcade_geometry::Pose;

    const CAMERA: PinholeCamera =
        PinholeCamera { fx: 720.0, fy: 720.0, cx: 600.0, cy: 180.0, width: 1242, height: 375 };

    fn ground() -> GroundFrame {
        let up = Vector3::new(0.01, -1.0, 0.01).normalize();
        GroundFrame {
            world_from_camera: Pose::identity(),
            up,
            height_m: 1.65,
            pitch_sigma_rad: 1e-3,
            time_s: 0.0,
        }
    }

    fn car(bbox: BoundingBox) -> Detection {
        Detection {
            class: VehicleClass::Car,
            score: 1.0,
            bbox,
            convention: BoxConvention::VisibleExtent,
            external_id: None,
        }
    }

    #[test]
    fn exact_boxes_give_exact_places() {
        let prior = size_prior(VehicleClass::Car);
        for (ahead, left, heading) in
            [(12.0, -3.0, 0.0), (25.0, 4.0, 3.0), (8.0, -4.5, 0.2), (40.0, 1.0, 0.0)]
        {
            let truth = ground().point(ahead, left, 0.0);
            let pose = standing_pose(&truth, &ground().direction_of(heading), &ground().up);
            for convention in [BoxConvention::VisibleExtent, BoxConvention::ProjectedCuboid] {
                let bbox = image_box(&CAMERA, &pose, VehicleClass::Car, convention, &prior.mean).unwrap();
                let seen = ObservedBox::new(&Detection { convention, ..car(bbox) }, &CAMERA, &[]);
                let found = locate(&CAMERA, &ground(), &seen, heading, &prior).unwrap();
                let error = (found.position_in_camera - truth).norm();
                assert!(error < 0.02 * ahead, "{convention:?} {ahead} {left}: {error}");
                assert!(found.covariance.symmetric_eigenvalues().min() > 0.0);
            }
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let (class, ground) = (VehicleClass::Car, ground());
        let rotation =
            standing_pose(&Point3::origin(), &ground.direction_of(0.4), &ground.up).rotation_matrix();
        let x = Vector6::new(14.0, 3.0, 0.1, 4.2, 1.8, 1.5);
        let at = |x: &Vector6<f64>| {
            let place = ground.point(x[0], x[1], x[2]).coords;
            touching(
                &CAMERA,
                &rotation,
                &place,
                (class, BoxConvention::VisibleExtent),
                &x.fixed_rows::<3>(3).into_owned(),
            )
            .unwrap()
        };
        let here = at(&x);
        for k in 0..6 {
            let mut moved = x;
            moved[k] += 1e-6;
            for (edge, there) in at(&moved).iter().enumerate() {
                let analytic = derivative(&CAMERA, edge, &here[edge], &axes(&ground), &rotation)[k];
                assert!(((there.pixel - here[edge].pixel) / 1e-6 - analytic).abs() < 1e-3, "{edge} {k}");
            }
        }
    }

    #[test]
    fn the_place_moves_with_the_size_as_differences_say() {
        // The box of this size, and the size held tightly at its value and at its neighbours.
        let size = Vector3::new(4.2, 1.7, 1.5);
        let pose = standing_pose(&ground().point(18.0, -2.5, 0.0), &ground().direction_of(0.5), &ground().up);
        let bbox = image_box(
            &CAMERA,
            &pose,
            VehicleClass::Car,
            BoxConvention::VisibleExtent,
            &Dimensions::from_vector(&size),
        )
        .unwrap();
        let seen = ObservedBox::new(&car(bbox), &CAMERA, &[]);
        let held = |size: &Vector3<f64>| {
            let sigma = Dimensions::from_vector(&Vector3::repeat(1e-5));
            let prior = SizePrior { mean: Dimensions::from_vector(size), sigma };
            locate(&CAMERA, &ground(), &seen, 0.5, &prior).unwrap()
        };
        let slope = held(&size).by_mean_size(&(Matrix3::identity() * 1e10)).unwrap();
        for k in 0..3 {
            let h = 1e-3 * Vector3::ith(k, 1.0);
            let numeric =
                (held(&(size + h)).position_in_camera - held(&(size - h)).position_in_camera) / 2e-3;
            let analytic = slope.column(k);
            assert!((numeric - analytic).norm() < 0.01 * (1.0 + numeric.norm()), "{k}: {numeric} {analytic}");
        }
        // A higher car with the same box stands further away.
        assert!(slope[(2, 2)] > 3.0, "{slope}");
    }

    #[test]
    fn the_place_moves_with_the_heading_as_differences_say() {
        let prior = size_prior(VehicleClass::Car);
        let information = Matrix3::identity() * 1e6;
        let pose = standing_pose(&ground().point(18.0, -2.5, 0.0), &ground().direction_of(0.1), &ground().up);
        let bbox =
            image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean).unwrap();
        let seen = ObservedBox::new(&car(bbox), &CAMERA, &[]);
        let at = |heading: f64| {
            locate_sized(&CAMERA, &ground(), &seen, heading, &prior.mean, &information).unwrap()
        };
        let numeric = (at(0.101).position_in_camera - at(0.099).position_in_camera) / 2e-3;
        let analytic = at(0.1).by_heading(&information).unwrap();
        assert!((numeric - analytic).norm() < 0.05 * (1.0 + numeric.norm()), "{numeric} {analytic}");
        // Turned further it shows more of its side: as wide a box then stands further away.
        assert!(analytic.z > 5.0, "{analytic}");
    }

    /// The lower part of a car behind another: its roof, as high as the camera, hardly tells the distance.
    #[test]
    fn a_hidden_bottom_does_not_put_a_vehicle_anywhere() {
        let prior = size_prior(VehicleClass::Car);
        for ahead in [12.0, 25.0, 45.0] {
            let truth = ground().point(ahead, -3.0, 0.0);
            let pose = standing_pose(&truth, &ground().direction_of(0.0), &ground().up);
            let whole =
                image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean)
                    .unwrap();
            for hidden in [0.0, 0.2, 0.4] {
                let bbox = BoundingBox { y2: whole.y2 - hidden * whole.height(), ..whole };
                for edges in
                    [[true, true, true, false], [true, true, false, false], [false, true, true, false]]
                {
                    let seen = ObservedBox {
                        bbox,
                        class: VehicleClass::Car,
                        convention: BoxConvention::VisibleExtent,
                        edges,
                    };
                    let found = locate(&CAMERA, &ground(), &seen, 0.0, &prior).unwrap();
                    let error = (found.position_in_camera - truth).norm() / ahead;
                    assert!(error < 0.1 + hidden, "{ahead} m, {hidden} hidden, {edges:?}: {error}");
                }
            }
        }
        // Cut off at two borders beside the camera: near, if anywhere.
        let bbox = BoundingBox { x1: 0.0, y1: 160.0, x2: 204.0, y2: 374.0 };
        let seen = ObservedBox::new(&car(bbox), &CAMERA, &[]);
        let found = locate(&CAMERA, &ground(), &seen, 0.0, &prior);
        assert!(found.is_none_or(|f| f.position_in_camera.z < 9.0), "{found:?}");
    }

    /// A car that leaves at the left: its bonnet is lower than its roof, and its tyres are out of sight.
    #[test]
    fn the_part_of_a_car_at_the_border_is_not_taken_for_a_small_one() {
        let prior = size_prior(VehicleClass::Car);
        for left in [7.0, 7.5, 8.0] {
            let truth = ground().point(9.0, left, 0.0);
            let pose = standing_pose(&truth, &ground().direction_of(0.0), &ground().up);
            let whole =
                image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean)
                    .unwrap();
            let (top, bottom) = (whole.y1 + 0.25 * whole.height(), whole.y2 - 0.15 * whole.height());
            let bbox = BoundingBox { x1: 0.0, y1: top, y2: bottom, ..whole };
            let seen = ObservedBox::new(&car(bbox), &CAMERA, &[]);
            assert_eq!(seen.edges, [false, true, true, true]);
            let found = locate(&CAMERA, &ground(), &seen, 0.0, &prior).unwrap();
            let off = found.position_in_camera - truth;
            let sigmas = off.dot(&(found.covariance.try_inverse().unwrap() * off)).sqrt();
            assert!(off.norm() < 1.5 && sigmas < 2.0, "{left}: {off}, {sigmas} standard deviations");
        }
    }

    #[test]
    fn cut_off_and_hidden_edges_are_recognised() {
        let cut = BoundingBox { x1: 0.0, y1: 150.0, x2: 200.0, y2: 374.0 };
        assert_eq!(ObservedBox::new(&car(cut), &CAMERA, &[]).edges, [false, true, true, false]);
        let far = BoundingBox { x1: 500.0, y1: 170.0, x2: 600.0, y2: 230.0 };
        let near = BoundingBox { x1: 540.0, y1: 150.0, x2: 700.0, y2: 300.0 };
        let seen = ObservedBox::new(&car(far), &CAMERA, &[far, near]);
        assert_eq!(seen.edges, [true, true, false, false]);
        // Corners are drawn behind other vehicles too.
        let label = Detection { convention: BoxConvention::ProjectedCuboid, ..car(far) };
        assert_eq!(ObservedBox::new(&label, &CAMERA, &[far, near]).edges, [true; 4]);
    }
}
