//! Night: low beams of the camera's own car, a little light from elsewhere.

use super::colour::{Colour, scaled};
use super::surface_pixel::SurfacePixel;

/// Light from elsewhere, of that of a day.
const AMBIENT: f64 = 0.035;
/// Depth at which the beams are as bright as an overcast day \[m\].
const REACH_M: f64 = 9.0;
/// Brightness where the beams are brightest: nearer road lies below them.
const MOST: f64 = 1.4;
/// Half width of the beams, as the tangent of an angle.
const HALF_WIDTH: f64 = 0.45;
/// Width of the transition at the cut-off of low beams, as a tangent, and the share of light above it.
const CUT_OFF: f64 = 0.012;
const ABOVE: f64 = 0.05;

/// Colour by night of a pixel that is `colour` by day; its ray as components to the right, down and forward of the camera.
pub(super) fn seen(colour: Colour, seen: &SurfacePixel, [right, down, forward]: [f64; 3]) -> Colour {
    let (across, below) = (right / forward, down / forward);
    let low = ABOVE + (1.0 - ABOVE) / (1.0 + (-below / CUT_OFF).exp());
    let wide = (-(across / HALF_WIDTH).powi(2)).exp();
    let beam = (REACH_M / seen.depth_m).powi(2).min(MOST) * low * wide;
    scaled(colour, (AMBIENT + beam) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn the_road_ahead_is_lit_and_the_rest_is_dark() {
        let at = |depth_m: f64, x: f64, y: f64| {
            let ray = Vector3::new(x, y, 1.0).normalize();
            let pixel = SurfacePixel { ray, depth_m, road: 1.0 };
            seen([0.5; 3], &pixel, [ray.x, ray.y, ray.z])[0]
        };
        let (near, far, sky) = (at(9.0, 0.0, 0.18), at(40.0, 0.0, 0.04), at(f64::INFINITY, 0.0, -0.2));
        assert!(near > 0.4 && far < 0.1 * near && sky < 0.6 * far, "{near} {far} {sky}");
        assert!(at(9.0, 1.0, 0.18) < 0.1 * near);
    }
}
