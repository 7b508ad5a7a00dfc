//! The camera's height in the odometry's unit by the likelihood of many pairs of frames.
//!
//! Two pictures of smooth asphalt agree about as well at false heights as at the true one. The false ones differ from pair to pair,
//! because they come from texture that repeats; so the likelihoods of several baselines and frames are added up over seconds. The
//! normal of the road is that of the direction of travel: the car drives along the road.

mod filter;
mod likelihood;
mod mirror;
mod mirror_options;
mod options;
mod travel;

pub(super) use filter::{FilterState, HeightEstimate, HeightFilter};
pub(super) use likelihood::HeightSamples;
pub(super) use mirror::{MirrorPair, MirrorState, MirrorTest, MirrorView};
pub use mirror_options::MirrorOptions;
pub use options::HeightOptions;
pub(super) use travel::Travel;
