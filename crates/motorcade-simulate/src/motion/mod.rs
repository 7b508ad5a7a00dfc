//! Geometry of the road, and motion of vehicles on it.

mod bicycle;
mod path;
mod polyline;
mod road;
mod speed;

pub(crate) use bicycle::{Axles, PlanarState, follow};
pub(crate) use path::Path;
pub(crate) use polyline::{averaged, every_metre};
pub use road::{Bend, Grade, Road, RoadPlan, RoadPoint};
pub(crate) use road::{CROSSING_HALF_WIDTH_M, axes};
pub use speed::SpeedPlan;
