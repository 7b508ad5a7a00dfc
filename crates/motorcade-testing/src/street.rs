//! A street of points, and their images.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use nalgebra::{Point2, Point3};

use crate::CAMERA_HEIGHT_M;

/// Points of a level road and of the house fronts beside it, 80 m long, in the world of a drive's first camera \[m\]. Deterministic,
/// scattered by multiples of the golden section.
pub fn street() -> Vec<Point3<f64>> {
    let scatter = |n: usize| (0.618_033_988_749_895 * n as f64).fract() - 0.5;
    let point = |k: usize| {
        let z = 4.0 + 80.0 * (0.754_877_666_246_693 * k as f64).fract();
        match k % 3 {
            0 => Point3::new(7.0 * scatter(k), CAMERA_HEIGHT_M, z),
            1 => Point3::new(-8.0 + scatter(k), CAMERA_HEIGHT_M - 3.0 - 6.0 * scatter(7 * k), z),
            _ => Point3::new(9.0 + scatter(k), CAMERA_HEIGHT_M - 3.0 - 6.0 * scatter(5 * k), z),
        }
    };
    (0..600).map(point).collect()
}

/// Image of a world point \[px\]; `None` when it is behind the camera or outside the image.
pub fn project(
    camera: &PinholeCamera,
    world_from_camera: &Pose<World, Camera>,
    point_in_world: &Point3<f64>,
) -> Option<Point2<f64>> {
    let pixel = camera.project(&world_from_camera.inverse().transform_point(point_in_world))?;
    let inside = |v: f64, size: u32| v >= 0.0 && v <= f64::from(size) - 1.0;
    (inside(pixel.x, camera.width) && inside(pixel.y, camera.height)).then_some(pixel)
}
