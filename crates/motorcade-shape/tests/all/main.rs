//! Tests of the shape prior and its fit. One program: it links once.

mod catalogue;
mod common;
mod published;
mod published_dimensions;
mod real_keypoints;
mod simulated;
