//! A run on the map of the earth (WGS 84): placed by a start, or aligned with a GPS track; written as GeoJSON, GPX, KML, in the
//! columns of KITTI's oxts files, and as an OpenSCENARIO file.
//!
//! The world of a run is that of its first camera. On the map its vertical is the normal of the road at the first frame, and its
//! direction of view is the heading, clockwise from north.

mod align;
mod anchor;
mod error;
mod scenario;
mod write;

pub use align::{AlignOptions, Alignment, align};
pub use anchor::{Anchor, Placed};
pub use error::Error;
pub use scenario::{Scenario, ScenarioOptions};
pub use write::{geojson, gpx, kml, oxts, places_geojson, xosc};
