//! Distances from the paved ground of a road.

use super::{Paved, Road};

impl Road {
    /// Distance of (s, d) from the paved ground beside the carriageway \[m\], negative on it; infinite without any.
    pub(crate) fn to_paving_m(&self, s: f64, d: f64) -> f64 {
        self.paved.iter().map(|p| p.outside_m(s, d)).fold(f64::INFINITY, f64::min)
    }

    /// Distance along the road to the nearest paved ground beside it \[m\], 0 beside one.
    pub(crate) fn along_to_paving_m(&self, s: f64) -> f64 {
        let away = |p: &Paved| {
            let (from, to) = p.extent_m();
            (from - s).max(s - to).max(0.0)
        };
        self.paved.iter().map(away).fold(f64::INFINITY, f64::min)
    }
}
