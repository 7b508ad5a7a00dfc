//! The image box of a vehicle: the extent of a few points on its outline.
//!
//! A cuboid's projection is larger than a detector's box: tyres touch the road an overhang behind the bumper, the bumper is
//! above the road, the roof is narrower than the body. At 20 m the overhang alone is 4 % of depth.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use motorcade_perception::{BoundingBox, BoxConvention, VehicleClass};
use nalgebra::{Matrix3, Point3, Vector3};

use motorcade_shape::Dimensions;

/// Smallest depth of an outline point \[m\]: nearer ones have no meaningful projection.
const NEAREST_M: f64 = 0.5;

/// Outline points of a car as fractions of (length, half width, height), each on both sides; estimated by eye from side and
/// rear views.
const CAR: [[f64; 3]; 12] = [
    // tyres where they touch the road, front and rear
    [0.31, 0.92, 0.0],
    [-0.29, 0.92, 0.0],
    // bumper corners, rounded in plan: low and high
    [0.5, 0.70, 0.17],
    [0.5, 0.70, 0.40],
    [0.45, 0.95, 0.30],
    [-0.5, 0.75, 0.20],
    [-0.5, 0.75, 0.55],
    [-0.46, 0.95, 0.40],
    // widest at the doors
    [0.15, 1.0, 0.45],
    [-0.25, 1.0, 0.45],
    // roof, front and rear
    [0.02, 0.70, 1.0],
    [-0.30, 0.68, 0.98],
];
/// Outline points of vans, lorries and buses.
const BOX: [[f64; 3]; 8] = [
    [0.33, 0.95, 0.0],
    [-0.30, 0.95, 0.0],
    [0.5, 0.9, 0.12],
    [-0.5, 0.95, 0.15],
    [0.48, 0.9, 0.85],
    [-0.5, 0.95, 0.97],
    [0.40, 0.95, 1.0],
    [0.0, 1.0, 0.5],
];
/// Outline points of a motorcycle with its rider.
const MOTORCYCLE: [[f64; 3]; 5] =
    [[0.35, 0.2, 0.0], [-0.35, 0.2, 0.0], [0.48, 0.2, 0.25], [-0.48, 0.3, 0.35], [0.0, 0.8, 1.0]];

/// Corners of the cuboid.
const CORNERS: [[f64; 3]; 4] = [[0.5, 1.0, 0.0], [0.5, 1.0, 1.0], [-0.5, 1.0, 0.0], [-0.5, 1.0, 1.0]];

fn outline(class: VehicleClass, convention: BoxConvention) -> &'static [[f64; 3]] {
    match (convention, class) {
        (BoxConvention::ProjectedCuboid, _) => &CORNERS,
        (BoxConvention::VisibleExtent, VehicleClass::Car) => &CAR,
        (BoxConvention::VisibleExtent, VehicleClass::Van | VehicleClass::Truck | VehicleClass::Bus) => &BOX,
        (BoxConvention::VisibleExtent, VehicleClass::Motorcycle) => &MOTORCYCLE,
    }
}

/// The outline point that bounds the image box on one side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExtremePoint {
    /// Position of the edge: u of left and right, v of top and bottom \[px\].
    pub(crate) pixel: f64,
    /// The point, camera frame \[m\].
    pub(crate) point: Point3<f64>,
    /// The point as fractions of (length, width, height) in the vehicle frame.
    pub(crate) fractions: Vector3<f64>,
}

/// Extreme outline points (left, top, right, bottom) of a vehicle whose axes are the columns of `rotation`; `None` when part
/// of it is behind or beside the camera.
pub(crate) fn extreme_points(
    camera: &PinholeCamera,
    rotation: &Matrix3<f64>,
    position: &Vector3<f64>,
    (class, convention): (VehicleClass, BoxConvention),
    size: &Vector3<f64>,
) -> Option<[ExtremePoint; 4]> {
    let none = ExtremePoint { pixel: f64::MAX, point: Point3::origin(), fractions: Vector3::zeros() };
    let mut edges = [none; 4];
    (edges[2].pixel, edges[3].pixel) = (f64::MIN, f64::MIN);
    for [x, y, z] in outline(class, convention) {
        for side in [-0.5, 0.5] {
            let fractions = Vector3::new(*x, side * y, *z);
            let point = Point3::from(rotation * fractions.component_mul(size) + position);
            if point.z < NEAREST_M {
                return None;
            }
            let pixel = camera.project(&point)?;
            for (edge, value) in [(0, pixel.x), (1, pixel.y)] {
                if value < edges[edge].pixel {
                    edges[edge] = ExtremePoint { pixel: value, point, fractions };
                }
                if value > edges[edge + 2].pixel {
                    edges[edge + 2] = ExtremePoint { pixel: value, point, fractions };
                }
            }
        }
    }
    Some(edges)
}

/// The unclipped image box of a vehicle; `None` when part of it is behind or beside the camera.
pub fn image_box(
    camera: &PinholeCamera,
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    class: VehicleClass,
    convention: BoxConvention,
    size: &Dimensions,
) -> Option<BoundingBox> {
    let (rotation, position) = (camera_from_vehicle.rotation_matrix(), camera_from_vehicle.translation());
    let edges = extreme_points(camera, &rotation, &position, (class, convention), &size.to_vector())?;
    Some(BoundingBox::new(edges.map(|e| e.pixel)))
}

/// The image box of a vehicle as a detector would see it unhidden, cut by the border of the picture; `None` where it is not in it, or a part of it beside the
/// camera.
pub fn box_in_picture(
    camera: &PinholeCamera,
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    class: VehicleClass,
    size: &Dimensions,
) -> Option<BoundingBox> {
    let bbox = image_box(camera, camera_from_vehicle, class, BoxConvention::VisibleExtent, size)?
        .clipped(camera.width, camera.height);
    (bbox.width() > 1.0 && bbox.height() > 1.0).then_some(bbox)
}

/// Pose of a vehicle on the road from its bottom centre, its forward direction and the road normal (camera frame, unit vectors).
pub fn upright_pose(
    position: &Point3<f64>,
    forward: &Vector3<f64>,
    up: &Vector3<f64>,
) -> Pose<Camera, Vehicle> {
    Pose::from_matrix(&upright_axes(forward, up), &position.coords)
}

/// Axes of an upright vehicle (forward, left, up as columns) from its forward direction and the road normal, both of length 1.
pub(crate) fn upright_axes(forward: &Vector3<f64>, up: &Vector3<f64>) -> Matrix3<f64> {
    let left = up.cross(forward).normalize();
    Matrix3::from_columns(&[left.cross(up), left, *up])
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::CAMERA;

    #[test]
    fn a_car_ahead_touches_the_road_with_its_rear_tyres() {
        let size = Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 };
        let pose = upright_pose(&Point3::new(0.0, 1.65, 20.0), &Vector3::z(), &-Vector3::y());
        let b = image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &size).unwrap();
        let rear_axle_z = 20.0 - 0.29 * 4.2;
        assert!((b.y2 - (180.0 + 720.0 * 1.65 / rear_axle_z)).abs() < 1e-9);
        assert!((b.x1 + b.x2 - 1200.0).abs() < 1e-9);
    }

    #[test]
    fn behind_the_camera_there_is_no_box() {
        let size = Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 };
        let pose = upright_pose(&Point3::new(0.0, 1.65, 1.0), &Vector3::z(), &-Vector3::y());
        assert!(image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &size).is_none());
    }
}
