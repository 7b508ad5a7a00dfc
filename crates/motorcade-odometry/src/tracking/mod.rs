//! Image pyramids, corners, and tracking them from frame to frame.

mod corners;
mod eigenvalues;
mod klt;
mod level;
mod options;
mod patch;
mod pyramid;
mod pyramid_pool;
mod static_mask;
pub(crate) mod stored;

pub use corners::detect;
pub use klt::{Request, track, track_checked};
pub use level::PyramidLevel;
pub use options::{AdvancedKltOptions, CornerOptions, KltOptions};
pub use pyramid::Pyramid;
pub(crate) use pyramid_pool::PyramidPool;
pub(crate) use static_mask::PixelClass;
pub use static_mask::StaticMask;
