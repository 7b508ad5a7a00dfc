//! The frame the simulator builds in.

use motorcade_geometry::Frame;

/// A gravity-aligned building site: x and y level, z up, metres. Not the project's `World`, which is the first camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Site;

impl Frame for Site {
    const NAME: &'static str = "site";
}
