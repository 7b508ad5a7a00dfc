//! Maps kept: keyframes with their landmarks in a file.

mod bytes;
mod error;
mod ply;
mod read;
mod write;

use motorcade_geometry::PinholeCamera;

use crate::keyframe::PlacedKeyframe;
pub use error::MapError;

/// First bytes of a map.
const MAGIC: &[u8; 8] = b"MCDRMAP\n";
/// Version of the format. Descriptors depend on the pattern of their tests: a change of it is another version.
const VERSION: u32 = 2;

/// Places of a drive, to be kept.
#[derive(Clone, Debug)]
pub struct PlaceMap {
    /// Camera of the drive (undistorted frames).
    pub camera: PinholeCamera,
    /// Height of the camera above the road \[m\].
    pub height_m: f64,
    /// Keyframes in order; features without a position are left out of files.
    pub keyframes: Vec<PlacedKeyframe>,
}

/// Facts about a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapSummary {
    /// Number of keyframes.
    pub keyframes: usize,
    /// Number of landmarks.
    pub landmarks: usize,
    /// Number of maps that no place joined.
    pub segments: usize,
    /// Way driven \[m\].
    pub way_m: f64,
}

impl PlaceMap {
    /// Facts about the map.
    pub fn summary(&self) -> MapSummary {
        let mut segments: Vec<usize> = self.keyframes.iter().map(|k| k.segment).collect();
        segments.sort_unstable();
        segments.dedup();
        MapSummary {
            keyframes: self.keyframes.len(),
            landmarks: self.keyframes.iter().map(|k| k.landmarks.len()).sum(),
            segments: segments.len(),
            way_m: self.keyframes.last().map_or(0.0, |k| k.way_m),
        }
    }
}

#[cfg(test)]
mod tests;
