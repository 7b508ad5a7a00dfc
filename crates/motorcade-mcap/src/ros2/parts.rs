//! Parts that messages share.

use motorcade_geometry::Pose;
use nalgebra::{Quaternion, Vector3};

use super::cdr::Cdr;

const NS: i64 = 1_000_000_000;

/// `std_msgs/Header`; times before zero are at zero.
pub(crate) fn header(out: &mut Cdr, time_ns: i64, frame: &str) {
    let time_ns = time_ns.max(0);
    out.i32(i32::try_from(time_ns / NS).unwrap_or(i32::MAX));
    out.u32((time_ns % NS) as u32);
    out.text(frame);
}

/// `geometry_msgs/Point` and `Vector3`.
pub(crate) fn vector(out: &mut Cdr, v: &Vector3<f64>) {
    out.f64s(&[v.x, v.y, v.z]);
}

/// `geometry_msgs/Quaternion`.
pub(crate) fn quaternion(out: &mut Cdr, q: &Quaternion<f64>) {
    out.f64s(&[q.i, q.j, q.k, q.w]);
}

/// `geometry_msgs/Pose` and `Transform`.
pub(crate) fn pose<A, B>(out: &mut Cdr, pose: &Pose<A, B>) {
    vector(out, &pose.translation());
    quaternion(out, pose.rotation().quaternion());
}
