//! Body types and positions of vehicle parts, from the project's own shape prior.

use std::sync::OnceLock;

use motorcade_perception::VehicleClass;
use motorcade_shape::{Blueprint, BodyType, Keypoint, Layout, ShapePrior};
use motorcade_vehicles::Dimensions;
use nalgebra::{Point3, Vector3};

/// Height of the roof's crown above its corners \[m\], as in the prior's drawings.
const ROOF_CORNER_DROP_M: f64 = 0.11;

/// Positions of a vehicle's parts as fractions: x of the length (0 in the middle), z of the height (0 on the road).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Form {
    /// x of the axles.
    pub front_axle: f64,
    pub rear_axle: f64,
    /// Radius of the tyres, as a fraction of the height.
    pub tyre_radius: f64,
    /// The glasshouse; only for bodies of the prior.
    pub glasshouse: Option<Glasshouse>,
}

/// Corners of the glasshouse, bonnet and tail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Glasshouse {
    /// (x, z) of the feet of the screens.
    pub windscreen: (f64, f64),
    pub rear_window: (f64, f64),
    /// x of the roof's ends and z of its corners.
    pub roof_front: f64,
    pub roof_rear: f64,
    pub roof_corner: f64,
    /// z above the lights.
    pub bonnet: f64,
    pub tail: f64,
}

impl Form {
    /// The form of a body of this size; cars and vans by the prior, others by rules of thumb.
    pub(crate) fn of(class: VehicleClass, body: Option<BodyType>, size: &Dimensions) -> Self {
        if let Some(plan) = body.and_then(blueprint) {
            return Self::drawn(plan);
        }
        let tyre_radius = match class {
            VehicleClass::Car => 0.212,
            VehicleClass::Van => 0.155,
            VehicleClass::Truck | VehicleClass::Bus => 0.5 / size.height_m.max(1.0),
            VehicleClass::Motorcycle => 0.20,
        };
        Self { front_axle: 0.31, rear_axle: -0.29, tyre_radius, glasshouse: None }
    }

    /// The form of a drawing.
    pub(crate) fn drawn(plan: &Blueprint) -> Self {
        let (x, z) = (|v: f64| v / plan.length_m, |v: f64| v / plan.height_m);
        let (front, rear) = (plan.front_axle_m(), plan.rear_axle_m());
        Self {
            front_axle: x(front),
            rear_axle: x(rear),
            tyre_radius: z(0.5 * plan.tyre_diameter_m),
            glasshouse: Some(Glasshouse {
                windscreen: (x(front - plan.windscreen_base_m), z(plan.windscreen_base_height_m)),
                rear_window: (x(rear - plan.rear_window_base_m), z(plan.rear_window_base_height_m)),
                roof_front: x(front - plan.roof_front_m),
                roof_rear: x(rear - plan.roof_rear_m),
                roof_corner: z(plan.height_m - ROOF_CORNER_DROP_M),
                bonnet: z(plan.bonnet_height_m),
                tail: z(plan.tail_height_m),
            }),
        }
    }
}

/// The body type a vehicle of this class and size has; `uniform` in [0, 1) selects among those that fit. `None` for
/// trucks, buses and motorcycles, which the prior does not have.
pub(crate) fn body_type(class: VehicleClass, size: &Dimensions, uniform: f64) -> Option<BodyType> {
    match class {
        VehicleClass::Van => Some(BodyType::Van),
        VehicleClass::Car => {
            // By share of traffic and by similarity of size, so that the drawing is stretched little.
            let weight = |body: BodyType| {
                let plan = blueprint(body)?;
                let off = Vector3::new(
                    (plan.length_m - size.length_m) / 0.25,
                    (plan.width_m - size.width_m) / 0.10,
                    (plan.height_m - size.height_m) / 0.08,
                );
                Some((body, body.share() * (-0.5 * off.norm_squared()).exp() + 1e-9))
            };
            let weights: Vec<(BodyType, f64)> = BodyType::ALL.into_iter().filter_map(weight).collect();
            let mut rest = uniform * weights.iter().map(|w| w.1).sum::<f64>();
            let found = weights.iter().find(|(_, w)| {
                rest -= w;
                rest < 0.0
            });
            found.or(weights.last()).map(|w| w.0)
        }
        VehicleClass::Truck | VehicleClass::Bus | VehicleClass::Motorcycle => None,
    }
}

/// Keypoints of a body stretched to a size (vehicle frame) \[m\].
pub(crate) fn keypoints(body: BodyType, size: &Dimensions, layout: Layout) -> Vec<Point3<f64>> {
    let prior = prior(layout);
    let shape = prior.body(prior.coefficients_of(body).unwrap_or_default());
    let stretch = size.to_vector().component_div(&shape.dimensions.to_vector());
    shape.keypoints.iter().map(|p| Point3::from(p.coords.component_mul(&stretch))).collect()
}

/// Keypoints of a layout.
pub(crate) fn named_keypoints(layout: Layout) -> &'static [Keypoint] {
    prior(layout).keypoints()
}

fn prior(layout: Layout) -> &'static ShapePrior {
    // Computed once: the principal components of the whole family are expensive.
    static PRIORS: OnceLock<[ShapePrior; 2]> = OnceLock::new();
    let [full, sparse] = PRIORS.get_or_init(|| [Layout::Car36, Layout::Car14].map(ShapePrior::of_family));
    match layout {
        Layout::Car36 => full,
        Layout::Car14 => sparse,
    }
}

fn blueprint(body: BodyType) -> Option<&'static Blueprint> {
    prior(Layout::Car36).named_shapes().iter().find(|n| n.body_type == body)?.blueprint.as_ref()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOLF: Dimensions = Dimensions { length_m: 4.2, width_m: 1.78, height_m: 1.48 };

    #[test]
    fn sizes_decide_about_bodies() {
        let share = |size: Dimensions, body| {
            let bodies = (0..200).map(|i| body_type(VehicleClass::Car, &size, f64::from(i) / 200.0));
            bodies.filter(|b| *b == Some(body)).count()
        };
        assert!(share(GOLF, BodyType::Hatchback) > 120);
        let suv = Dimensions { length_m: 4.5, width_m: 1.85, height_m: 1.7 };
        assert!(share(suv, BodyType::Suv) > 100 && share(suv, BodyType::Coupe) == 0);
        assert_eq!(body_type(VehicleClass::Bus, &GOLF, 0.5), None);
    }

    #[test]
    fn keypoints_stand_where_the_form_has_its_axles() {
        for body in BodyType::ALL {
            let points = keypoints(body, &GOLF, Layout::Car36);
            let form = Form::of(VehicleClass::Car, Some(body), &GOLF);
            // 0 rear, 1 front wheel centre of the left; the prior keeps 99 % of the variance of its drawings.
            for (point, axle) in [(points[0], form.rear_axle), (points[1], form.front_axle)] {
                assert!((point.x - axle * GOLF.length_m).abs() < 0.08, "{body:?}: {point} {axle}");
                assert!((point.z - form.tyre_radius * GOLF.height_m).abs() < 0.05, "{body:?}");
            }
        }
    }
}
