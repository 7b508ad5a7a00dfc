//! A low sun ahead: glare in the lens, glitter on the road.

use nalgebra::Vector3;

use super::colour::{Colour, added, scaled};
use super::surface_pixel::SurfacePixel;

/// Colour of the sun near the horizon.
const WARM: Colour = [1.0, 0.93, 0.78];
/// Light that the lens scatters over the whole picture.
const VEIL: f64 = 0.07;
/// Strength and angle \[rad\] of glare near the sun and farther off.
const GLARE: [(f64, f64); 2] = [(1.4, 0.09), (0.35, 0.40)];
/// Strength and angle \[rad\] of the reflection of the sun by dry asphalt at grazing angles.
const GLITTER: (f64, f64) = (0.7, 0.16);

/// Colour of a pixel, without glare `colour`, for the direction towards the sun (unit, site).
pub(super) fn seen(colour: Colour, seen: &SurfacePixel, sun: &Vector3<f64>) -> Colour {
    let angle = |direction: &Vector3<f64>| direction.dot(sun).clamp(-1.0, 1.0).acos();
    let away = angle(&seen.ray);
    let glare: f64 = GLARE.iter().map(|(strength, reach)| strength * (-away / reach).exp()).sum();
    let mirrored = Vector3::new(seen.ray.x, seen.ray.y, -seen.ray.z);
    let glitter = GLITTER.0 * f64::from(seen.road) * (-angle(&mirrored) / GLITTER.1).exp();
    added(colour, scaled(WARM, (VEIL + glare + glitter) as f32))
}
