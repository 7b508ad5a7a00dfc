//! Geometry of the road, and motion of vehicles on it.

mod bicycle;
mod path;
mod paved;
mod paving;
mod polyline;
mod road;
mod speed;
mod trailer;

pub(crate) use bicycle::{Axles, PlanarState, follow};
pub(crate) use path::Path;
pub use paved::Paved;
pub(crate) use polyline::{averaged, every_metre, rounded};
pub use road::{Bend, Grade, Road, RoadKind, RoadPlan, RoadPoint};
pub(crate) use road::{CROSSING_HALF_WIDTH_M, axes};
pub use speed::SpeedPlan;
pub(crate) use trailer::{Hitch, tow};
