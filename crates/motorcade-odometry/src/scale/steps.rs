//! Motion between consecutive frames, in the odometry's unit and in metres.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Vector6;

use crate::time::ratio;
use crate::trajectory::{FrameRecord, FrameStatus, OdometryTrajectory};

type CameraFromCamera = Pose<Camera, Camera>;

/// `camera_before_from_camera` of each frame in its segment's unit, eq. (2); bridged frames share the motion between their
/// neighbours by time. `None` at the first frame, at the start of a segment and where a segment ended bridged.
pub(super) fn unit_steps(odometry: &OdometryTrajectory) -> Vec<Option<CameraFromCamera>> {
    let frames = odometry.frames.kept();
    let n = frames.len();
    let mut poses: Vec<Option<Pose<Camera, World>>> = (0..n).map(|k| odometry.camera_from_world(k)).collect();
    let found = |k: usize| frames[k].status != FrameStatus::Bridged && frames[k].segment != usize::MAX;
    let mut k = 1;
    while k < n {
        if found(k) {
            k += 1;
            continue;
        }
        let end = (k..n).find(|e| found(*e));
        let neighbours = end.filter(|e| frames[*e].segment == frames[k - 1].segment);
        match neighbours.and_then(|e| Some((e, poses[k - 1]?, poses[e]?))) {
            Some((e, a, b)) => {
                let whole: CameraFromCamera = b * a.inverse();
                for i in k..e {
                    let fraction = fraction(frames, [k - 1, i, e]);
                    poses[i] = Some(CameraFromCamera::exp(&(whole.log() * fraction)) * a);
                }
            }
            None => (k..end.unwrap_or(n)).for_each(|i| poses[i] = None),
        }
        k = end.unwrap_or(n);
    }
    let step = |k: usize| {
        let same = k > 0 && frames[k].segment == frames[k - 1].segment;
        same.then(|| Some(poses[k - 1]? * poses[k]?.inverse())).flatten()
    };
    (0..n).map(step).collect()
}

/// `camera_before_from_camera` of each frame in metres. Across a break, where frames have no step of their own, the velocity
/// changes linearly in time from that before it to that after it.
pub(super) fn metric_steps(
    frames: &[FrameRecord],
    steps: &[Option<CameraFromCamera>],
    scales: &[f64],
) -> Vec<CameraFromCamera> {
    let own: Vec<Option<Vector6<f64>>> =
        steps.iter().zip(scales).map(|(s, scale)| s.map(|s| s.scaled(*scale).log())).collect();
    let interval_ns = |k: usize| if k > 0 { frames[k].timestamp_ns - frames[k - 1].timestamp_ns } else { 0 };
    // A twist over one interval as that over another.
    let over =
        |(from, twist): (usize, Vector6<f64>), to: usize| twist * ratio(interval_ns(to), interval_ns(from));
    let (mut out, mut before): (Vec<CameraFromCamera>, Option<(usize, Vector6<f64>)>) = (Vec::new(), None);
    while out.len() < own.len() {
        let k = out.len();
        if let (Some(twist), Some(step)) = (own[k], steps[k]) {
            before = Some((k, twist));
            out.push(step.scaled(scales[k]));
            continue;
        }
        let end = (k..own.len()).find(|e| own[*e].is_some()).unwrap_or(own.len());
        let after = own.get(end).copied().flatten().map(|twist| (end, twist));
        let (a, b) = (before.or(after), after.or(before));
        for i in k..end {
            let fraction =
                if i > 0 && end < own.len() { fraction(frames, [k.max(1) - 1, i, end]) } else { 1.0 };
            let twist = a.zip(b).map_or_else(Vector6::zeros, |(a, b)| over(a, i).lerp(&over(b, i), fraction));
            // The first frame of all has no step.
            out.push(if i == 0 { Pose::identity() } else { Pose::exp(&twist) });
        }
    }
    out
}

/// Time of a frame between two others, from 0 to 1.
fn fraction(frames: &[FrameRecord], [from, at, to]: [usize; 3]) -> f64 {
    let time = |k: usize| frames[k].timestamp_ns;
    ratio(time(at) - time(from), time(to) - time(from)).min(1.0)
}
