//! Poses and times as Foxglove's messages.

use foxglove::messages::{self, Quaternion, Timestamp};
use motorcade_geometry::Pose;
use nalgebra::Vector3;

/// A time of a frame \[ns\]; times before zero are at zero.
pub(crate) fn timestamp(time_ns: i64) -> Timestamp {
    let (seconds, rest) = (time_ns.max(0) / 1_000_000_000, time_ns.max(0) % 1_000_000_000);
    Timestamp::new(u32::try_from(seconds).unwrap_or(u32::MAX), rest as u32)
}

pub(crate) fn vector(v: &Vector3<f64>) -> messages::Vector3 {
    messages::Vector3 { x: v.x, y: v.y, z: v.z }
}

pub(crate) fn quaternion<A, B>(pose: &Pose<A, B>) -> Quaternion {
    let q = pose.rotation();
    Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
}

pub(crate) fn pose<A, B>(pose: &Pose<A, B>) -> messages::Pose {
    messages::Pose { position: Some(vector(&pose.translation())), orientation: Some(quaternion(pose)) }
}
