//! Built-in factors.

mod between;
mod between_plane;
mod between_similarity;
mod blocks;
mod linear;
mod mat3;
mod point;
mod pose_error;
mod pose_residual;
mod prior;

pub use between::Between;
pub use between_plane::BetweenPlane;
pub use between_similarity::BetweenSimilarity;
pub use linear::LinearPrior;
pub use point::PoseToPoint;
pub use pose_residual::PoseResidual;
pub use prior::{PosePrior, VectorPrior};
