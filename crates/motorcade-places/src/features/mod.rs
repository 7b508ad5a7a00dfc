//! Corners and their binary descriptors.

mod blur;
mod corners;
mod descriptor;
mod extract;
mod feature;
mod halve;
mod orientation;
mod pattern;
mod spread;

pub use descriptor::Descriptor;
pub use extract::FeatureExtractor;
pub use feature::Feature;
