//! Places seen again.
mod features;
mod options;

pub use features::{Descriptor, Feature, FeatureExtractor};
pub use options::{
    FeatureOptions, LandmarkOptions, PlaceOptions, SearchOptions, SequenceOptions, VerificationOptions,
};
