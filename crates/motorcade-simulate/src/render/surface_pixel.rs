//! A pixel and its surface, for light that depends on the camera's place.

use nalgebra::Vector3;

/// A pixel and its surface.
pub(super) struct SurfacePixel {
    /// From the camera, unit, in the site.
    pub ray: Vector3<f64>,
    /// Along the optical axis \[m\]; infinite for the sky.
    pub depth_m: f64,
    /// Share of carriageway.
    pub road: f32,
}
