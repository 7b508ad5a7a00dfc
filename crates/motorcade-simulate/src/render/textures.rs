//! Noise textures.

use super::tile::Tile;

/// Textures shared by all surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Textures {
    /// Grains and blotches of all sizes.
    pub noise: Tile,
    /// Thin dark lines.
    pub cracks: Tile,
    /// Soft and large.
    pub clouds: Tile,
}

impl Textures {
    pub(crate) fn new(seed: u64) -> Self {
        // Nearly the same amplitude at all scales, so that there is texture to track at every distance.
        let flat = |cells: usize| if cells < 8 { 0.4 } else { 1.0 };
        let noise = Tile::noise(seed, flat, |v| (1.3 * v).clamp(-1.0, 1.0));
        let line = |v: f32| -(1.0 - v.abs() * 22.0).clamp(0.0, 1.0);
        let cracks =
            Tile::noise(seed ^ 0x51, |cells| if cells <= 32 { 1.0 / cells as f32 } else { 0.0 }, line);
        let clouds = Tile::noise(seed ^ 0xc1, |cells| 1.0 / cells as f32, |v| (1.6 * v).clamp(-1.0, 1.0));
        Self { noise, cracks, clouds }
    }
}
