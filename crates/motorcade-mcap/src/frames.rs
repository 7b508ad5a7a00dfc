//! Names of the frames of reference.

/// `map` is the world with z up: x_map = z, y_map = −x, z_map = −y.
pub(crate) const MAP: &str = "map";
pub(crate) const WORLD: &str = "world";
pub(crate) const CAMERA: &str = "camera";
