//! One car as a blueprint: a few lengths from which every named point follows.

use nalgebra::{Point3, Vector3};

use crate::dimensions::Dimensions;
use crate::keypoint::Layout;

/// The lengths of one car \[m\]. Heights are over the road; "behind" and "ahead of" are along the vehicle's x axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blueprint {
    /// Bumper to bumper.
    pub length_m: f64,
    /// Side to side without mirrors.
    pub width_m: f64,
    /// Road to roof.
    pub height_m: f64,
    /// Front axle to rear axle.
    pub wheelbase_m: f64,
    /// Front bumper to front axle.
    pub front_overhang_m: f64,
    /// Outer diameter of the tyres.
    pub tyre_diameter_m: f64,
    /// Height of the bonnet's front corner, above the headlight.
    pub bonnet_height_m: f64,
    /// Base of the windscreen behind the front axle.
    pub windscreen_base_m: f64,
    /// Height of the windscreen's base.
    pub windscreen_base_height_m: f64,
    /// Front edge of the roof behind the front axle.
    pub roof_front_m: f64,
    /// Rear edge of the roof behind the rear axle (negative: ahead of it, as on saloons).
    pub roof_rear_m: f64,
    /// Base of the rear window behind the rear axle.
    pub rear_window_base_m: f64,
    /// Height of the rear window's base.
    pub rear_window_base_height_m: f64,
    /// Height of the boot lid's corner, above the tail light.
    pub tail_height_m: f64,
}

/// A point of the left side before mirroring; its name is completed by "left" or "right".
#[derive(Clone, Debug)]
pub(crate) struct SidePoint {
    /// Name without the side.
    pub name: &'static str,
    /// Position in the vehicle frame \[m\].
    pub position: Point3<f64>,
    /// Outward directions of the faces it lies on (unit); it is seen when one of them faces the camera.
    pub faces: &'static [[f64; 3]],
}

/// Gap between the edge of the wheel arch and the tyre \[m\].
const ARCH_GAP_M: f64 = 0.09;
/// Distance of the tyre's outer wall inside the body's largest width \[m\].
const TYRE_INSET_M: f64 = 0.03;
/// Distance of the roof's corners (the top of the pillars) below the crown of the roof \[m\].
const ROOF_CORNER_DROP_M: f64 = 0.11;

const SIDE: [f64; 3] = [0.0, 1.0, 0.0];
const FRONT: [f64; 3] = [1.0, 0.0, 0.0];
const REAR: [f64; 3] = [-1.0, 0.0, 0.0];
/// From behind, a mirror shows beside the body on its own side, not across it.
const MIRROR_REAR: [f64; 3] = [-0.6, 0.8, 0.0];

impl Blueprint {
    /// Outer size.
    pub fn dimensions(&self) -> Dimensions {
        Dimensions { length_m: self.length_m, width_m: self.width_m, height_m: self.height_m }
    }
    /// x of the front axle in the vehicle frame \[m\].
    pub fn front_axle_m(&self) -> f64 {
        0.5 * self.length_m - self.front_overhang_m
    }
    /// x of the rear axle in the vehicle frame \[m\].
    pub fn rear_axle_m(&self) -> f64 {
        self.front_axle_m() - self.wheelbase_m
    }
    /// Rear bumper to rear axle \[m\].
    pub fn rear_overhang_m(&self) -> f64 {
        self.length_m - self.wheelbase_m - self.front_overhang_m
    }

    /// The keypoints of a layout (vehicle frame) \[m\], in its order.
    pub fn keypoints(&self, layout: Layout) -> Vec<Point3<f64>> {
        let side = match layout {
            Layout::Car36 => self.side_36(),
            Layout::Car14 => self.side_14(),
        };
        let mut points = vec![Point3::origin(); layout.count()];
        for (i, point) in side.iter().enumerate() {
            let (left, right) = layout.pair(i);
            let p = point.position;
            points[left] = p;
            points[right] = Point3::new(p.x, -p.y, p.z);
        }
        points
    }

    /// The mean blueprint; `None` of an empty list.
    pub(crate) fn average(plans: &[&Self]) -> Option<Self> {
        if plans.is_empty() {
            return None;
        }
        let mean = |f: fn(&Self) -> f64| plans.iter().map(|p| f(p)).sum::<f64>() / plans.len() as f64;
        Some(Self {
            length_m: mean(|p| p.length_m),
            width_m: mean(|p| p.width_m),
            height_m: mean(|p| p.height_m),
            wheelbase_m: mean(|p| p.wheelbase_m),
            front_overhang_m: mean(|p| p.front_overhang_m),
            tyre_diameter_m: mean(|p| p.tyre_diameter_m),
            bonnet_height_m: mean(|p| p.bonnet_height_m),
            windscreen_base_m: mean(|p| p.windscreen_base_m),
            windscreen_base_height_m: mean(|p| p.windscreen_base_height_m),
            roof_front_m: mean(|p| p.roof_front_m),
            roof_rear_m: mean(|p| p.roof_rear_m),
            rear_window_base_m: mean(|p| p.rear_window_base_m),
            rear_window_base_height_m: mean(|p| p.rear_window_base_height_m),
            tail_height_m: mean(|p| p.tail_height_m),
        })
    }

    /// y of the tyres' outer wall on the left \[m\].
    fn tyre_side_m(&self) -> f64 {
        0.5 * self.width_m - TYRE_INSET_M
    }
    /// A point on the left at a share of the half width.
    fn at(&self, x: f64, share: f64, z: f64) -> Point3<f64> {
        Point3::new(x, 0.5 * self.width_m * share, z)
    }

    /// The 18 left-side points of the 36-keypoint layout, in its order.
    pub(crate) fn side_36(&self) -> Vec<SidePoint> {
        let (front, rear) = (self.front_axle_m(), self.rear_axle_m());
        let (nose, tail) = (0.5 * self.length_m, -0.5 * self.length_m);
        let radius = 0.5 * self.tyre_diameter_m;
        let wheel = |x: f64| Point3::new(x, self.tyre_side_m(), radius);
        let arch = |axle: f64, angle_deg: f64| {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            let reach = radius + ARCH_GAP_M;
            self.at(axle + reach * cos, 0.97, radius + reach * sin)
        };
        let roof = self.height_m - ROOF_CORNER_DROP_M;
        let point = |name, position, faces| SidePoint { name, position, faces };
        vec![
            point("rear wheel centre", wheel(rear), &[SIDE]),
            point("front wheel centre", wheel(front), &[SIDE]),
            point("front wheel arch, front low", arch(front, -5.0), &[SIDE]),
            point("front wheel arch, front high", arch(front, 45.0), &[SIDE]),
            point("front wheel arch, rear high", arch(front, 135.0), &[SIDE]),
            point("front wheel arch, rear low", arch(front, 185.0), &[SIDE]),
            point("rear wheel arch, front low", arch(rear, -5.0), &[SIDE]),
            point("rear wheel arch, front high", arch(rear, 45.0), &[SIDE]),
            point("rear wheel arch, rear high", arch(rear, 135.0), &[SIDE]),
            point("rear wheel arch, rear low", arch(rear, 185.0), &[SIDE]),
            point("rear bumper low corner", self.at(tail + 0.06, 0.86, 0.34), &[REAR, SIDE]),
            point(
                "boot lid corner at the tail light",
                self.at(tail + 0.08, 0.80, self.tail_height_m),
                &[REAR, SIDE],
            ),
            point(
                "rear window base",
                self.at(rear - self.rear_window_base_m, 0.78, self.rear_window_base_height_m),
                &[REAR, SIDE],
            ),
            point("roof rear corner", self.at(rear - self.roof_rear_m, 0.64, roof), &[REAR, SIDE]),
            point("roof front corner", self.at(front - self.roof_front_m, 0.64, roof), &[FRONT, SIDE]),
            point(
                "windscreen base",
                self.at(front - self.windscreen_base_m, 0.82, self.windscreen_base_height_m),
                &[FRONT, SIDE],
            ),
            point(
                "bonnet front corner at the headlight",
                self.at(nose - 0.12, 0.80, self.bonnet_height_m),
                &[FRONT, SIDE],
            ),
            point("front bumper low corner", self.at(nose - 0.06, 0.86, 0.27), &[FRONT, SIDE]),
        ]
    }

    /// The 7 left-side points of the 14-keypoint layout, in its order.
    pub(crate) fn side_14(&self) -> Vec<SidePoint> {
        let (nose, tail) = (0.5 * self.length_m, -0.5 * self.length_m);
        let full = self.side_36();
        let same = |index: usize| full[index].clone();
        let point = |name, position, faces| SidePoint { name, position, faces };
        vec![
            same(1),
            same(0),
            point("headlight", self.at(nose - 0.14, 0.77, self.bonnet_height_m - 0.05), &[FRONT, SIDE]),
            point("tail light", self.at(tail + 0.08, 0.80, self.tail_height_m - 0.07), &[REAR, SIDE]),
            point("mirror", self.mirror(0.06), &[SIDE, FRONT, MIRROR_REAR]),
            same(14),
            same(13),
        ]
    }

    /// The mirror on the left, so far beyond the body's side \[m\].
    fn mirror(&self, beyond_m: f64) -> Point3<f64> {
        let foot = self.at(
            self.front_axle_m() - self.windscreen_base_m - 0.40,
            1.0,
            self.windscreen_base_height_m + 0.05,
        );
        foot + Vector3::y() * beyond_m
    }

    /// Points on the left side that bound the body, and so its image box, in any view.
    pub(crate) fn side_outline(&self) -> Vec<SidePoint> {
        let (front, rear) = (self.front_axle_m(), self.rear_axle_m());
        let (nose, tail) = (0.5 * self.length_m, -0.5 * self.length_m);
        let (roof_front, roof_rear) = (front - self.roof_front_m, rear - self.roof_rear_m);
        let belt = 0.62 * self.windscreen_base_height_m;
        let point = |name, position| SidePoint { name, position, faces: &[] };
        vec![
            point("nose", self.at(nose, 0.45, 0.5)),
            point("tail", self.at(tail, 0.45, 0.5)),
            point("door", self.at(0.5 * (front + rear), 1.0, belt)),
            point("roof crown", self.at(0.5 * (roof_front + roof_rear), 0.42, self.height_m)),
            point("front tyre on the road", Point3::new(front, self.tyre_side_m(), 0.0)),
            point("rear tyre on the road", Point3::new(rear, self.tyre_side_m(), 0.0)),
            point("front wing", self.at(front, 1.0, belt)),
            point("rear wing", self.at(rear, 1.0, belt)),
            point("front bumper", self.at(nose - 0.10, 0.84, 0.5)),
            point("rear bumper", self.at(tail + 0.08, 0.86, 0.5)),
            point("front skirt", self.at(nose - 0.05, 0.70, 0.20)),
            point("rear skirt", self.at(tail + 0.05, 0.70, 0.28)),
            point("roof front crown", self.at(roof_front - 0.25, 0.45, self.height_m - 0.03)),
            point("roof rear crown", self.at(roof_rear + 0.20, 0.45, self.height_m - 0.04)),
            point("mirror tip", self.mirror(0.11)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::FAMILY;

    #[test]
    fn keypoints_of_a_drawing_are_those_of_the_prior_in_the_same_order() {
        let prior = crate::ShapePrior::of_family(Layout::Car36);
        for named in prior.named_shapes() {
            let drawn = named.blueprint.unwrap().keypoints(Layout::Car36);
            let fitted = prior.points(&named.coefficients);
            // The prior keeps 99 % of the variance of its drawings.
            for (i, (a, b)) in drawn.iter().zip(&fitted).enumerate() {
                assert!((a - b).norm() < 0.08, "{:?} keypoint {i}: {a} {b}", named.body_type);
            }
        }
    }

    #[test]
    fn every_car_of_the_family_is_drawn_inside_its_own_box() {
        for model in FAMILY {
            let plan = model.blueprint;
            let points = plan.side_36().into_iter().chain(plan.side_14()).chain(plan.side_outline());
            for point in points {
                let p = point.position;
                let beside = if point.name.starts_with("mirror") { 0.12 } else { 0.0 };
                assert!(p.x.abs() <= 0.5 * plan.length_m + 1e-9, "{} {}", model.name, point.name);
                assert!(p.y > 0.0 && p.y <= 0.5 * plan.width_m + beside, "{} {}", model.name, point.name);
                assert!(p.z >= 0.0 && p.z <= plan.height_m, "{} {}", model.name, point.name);
            }
        }
    }

    #[test]
    fn every_car_is_built_in_order_from_tail_to_nose() {
        for model in FAMILY {
            let side = model.blueprint.side_36();
            let x = |i: usize| side[i].position.x;
            let order = [x(10), x(13), x(14), x(15), x(16)];
            assert!(order.windows(2).all(|w| w[0] < w[1]), "{}: {order:?}", model.name);
            assert!(x(12) <= x(13) && x(11) <= x(12) + 0.02, "{}", model.name);
            assert!(x(0) < x(1) && model.blueprint.rear_overhang_m() > 0.3, "{}", model.name);
        }
    }
}
