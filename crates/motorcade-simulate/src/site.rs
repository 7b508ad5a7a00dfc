//! The frame of the simulator.

use motorcade_geometry::Frame;

/// Gravity-aligned world of the simulator: x and y level, z up \[m\]. The project's `World` is the first camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Site;

impl Frame for Site {
    const NAME: &'static str = "site";
}
