//! Built-in factors.

mod between;
mod between_plane;
mod between_similarity;
mod blocks;
mod linear;
mod mat3;
mod point;
pub(crate) mod pose_error;
mod prior;

pub use between::{Between, PoseResidual};
pub use between_plane::BetweenPlane;
pub use between_similarity::BetweenSimilarity;
pub use linear::LinearPrior;
pub use point::PoseToPoint;
pub use prior::{PosePrior, VectorPrior};
