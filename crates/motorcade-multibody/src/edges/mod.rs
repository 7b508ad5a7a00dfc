//! The edges of the multi-object graph, for the whole drive or a window of it.

mod camera;
mod edge;
mod motion;
mod vehicle;

pub(crate) use camera::motion_of;
pub(crate) use camera::{of_cameras, step_is_held};
pub(crate) use edge::{EdgeContext, inverse, is_static, shares_size};
pub(crate) use vehicle::{TrackNodes, of_vehicle};
