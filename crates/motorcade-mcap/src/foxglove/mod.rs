//! Foxglove's schemas, as protobuf.

mod annotations;
mod camera;
mod colour;
mod convert;
mod topics;
mod vehicles;

pub(crate) use topics::Topics;
