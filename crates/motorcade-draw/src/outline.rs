//! The cuboid of a vehicle as lines, for drawings that are made elsewhere.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};

use crate::cuboid::Cuboid;
use crate::view::View;

/// Edges of a vehicle's cuboid that its body does not hide, two ends x, y each \[px\], clipped to the image and a margin of 20 px.
/// Empty for a vehicle behind the camera or around it. `size_m`: length, width, height.
pub fn visible_edges(
    camera: &PinholeCamera,
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    size_m: [f64; 3],
) -> Vec<[[f64; 2]; 2]> {
    let (view, cuboid) = (View::new(*camera), Cuboid::new(camera_from_vehicle, size_m));
    cuboid.edges(true).filter_map(|[a, b]| view.segment(&a, &b)).collect()
}
