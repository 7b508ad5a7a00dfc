//! Image pyramids, corners, and following them from frame to frame.

mod corners;
mod klt;
mod pyramid;
mod pyramid_pool;
mod static_mask;

pub use corners::{CornerOptions, detect};
pub use klt::{KltOptions, Request, track, track_checked};
pub use pyramid::{Plane, Pyramid};
pub(crate) use pyramid_pool::PyramidPool;
pub(crate) use static_mask::Place;
pub use static_mask::StaticMask;
