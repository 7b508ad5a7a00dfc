//! Messages of ROS 2's common interfaces, as CDR.

mod camera;
mod cdr;
mod definitions;
mod parts;
mod topics;
mod vehicles;

pub(crate) use topics::Topics;
