//! Frames in a wrong order: the camera goes ahead, back and ahead again within three frames, which no vehicle can.

use motorcade_geometry::{Pose, World};
use motorcade_odometry::{EgoFrame, FrameStatus};
use nalgebra::Vector3;

use crate::check_options::SwappedFrameOptions;
use crate::record::FrameInfo;

/// A warning that names the frames that seem to be swapped.
pub(crate) fn of(frames: &[FrameInfo], ego: &[EgoFrame], options: &SwappedFrameOptions) -> Option<String> {
    let pairs: Vec<(u64, u64)> = (2..ego.len().min(frames.len()).saturating_sub(1))
        .filter(|k| swapped(frames, ego, *k, options))
        .map(|k| (frames[k - 1].number, frames[k].number))
        .collect();
    let (count, most) = (pairs.len(), options.named);
    let named: Vec<String> = pairs.iter().take(most).map(|(a, b)| format!("{a} and {b}")).collect();
    let more = if count > most { format!(" and {} more pairs", count - most) } else { String::new() };
    (count > 0).then(|| {
        format!(
            "frames {}{more} seem to be in the wrong order: the camera goes ahead, back and ahead again; check the names or times of the pictures",
            named.join(", ")
        )
    })
}

/// True when the camera goes back from frame k − 1 to k, and ahead twice as far in the steps before and after.
fn swapped(frames: &[FrameInfo], ego: &[EgoFrame], k: usize, options: &SwappedFrameOptions) -> bool {
    // A pose that was filled in between its neighbours has no step of its own.
    let tracked = ego[k - 2..=k + 1].iter().all(|f| f.status == FrameStatus::Tracked);
    if !tracked {
        return false;
    }
    let position = |k: usize| -> Vector3<f64> { place(&ego[k].world_from_camera) };
    let [before, back, after] = [k - 1, k, k + 1].map(|k| position(k) - position(k - 1));
    let way = back.norm();
    let [least, most] = options.ahead_over_back;
    let contrary = |step: &Vector3<f64>| {
        step.dot(&back) < options.opposite_cosine * way * step.norm()
            && (least..most).contains(&(step.norm() / way))
    };
    let time_s = |k: usize| (frames[k].timestamp_ns - frames[k - 1].timestamp_ns) as f64 * 1e-9;
    let change = |a: (usize, Vector3<f64>), b: (usize, Vector3<f64>)| {
        (b.1 / time_s(b.0) - a.1 / time_s(a.0)).norm() / time_s(a.0).max(time_s(b.0))
    };
    let violent = change((k - 1, before), (k, back)).min(change((k, back), (k + 1, after)));
    contrary(&before) && contrary(&after) && violent > options.most_acceleration_mps2
}

fn place<From>(pose: &Pose<World, From>) -> Vector3<f64> {
    pose.translation()
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Camera;
    use nalgebra::{Matrix3, Matrix6, Vector6};

    /// A drive by the way of the camera at each frame \[m\], 10 frames/s.
    fn drive(way_m: &[f64]) -> (Vec<FrameInfo>, Vec<EgoFrame>) {
        let frame = |k: usize| FrameInfo {
            number: 100 + k as u64,
            timestamp_ns: k as i64 * 100_000_000,
            problem: None,
        };
        let pose = |z: f64| Pose::<World, Camera>::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, z));
        let ego = |z: &f64| EgoFrame {
            world_from_camera: pose(*z),
            status: FrameStatus::Tracked,
            step_measured: true,
            step_covariance: Matrix6::zeros(),
            covariance: Matrix6::zeros(),
            scale: 1.0,
            scale_sigma: 0.01,
            scale_sigma_alone: 0.01,
            scale_correlation: 0.0,
            scale_bias_sigma: 0.0,
            scale_measured: true,
            road_normal: -Vector3::y(),
            road_tilt_covariance: Matrix3::zeros(),
            inliers: 100,
        };
        ((0..way_m.len()).map(frame).collect(), way_m.iter().map(ego).collect())
    }

    #[test]
    fn two_swapped_frames_are_named_and_honest_drives_are_not() {
        let options = SwappedFrameOptions::default();
        let even: Vec<f64> = (0..30).map(|k| 0.8 * f64::from(k)).collect();
        let (frames, ego) = drive(&even);
        assert_eq!(of(&frames, &ego, &options), None);
        let mut swapped = even.clone();
        swapped.swap(10, 11);
        let (frames, ego) = drive(&swapped);
        let said = of(&frames, &ego, &options).unwrap();
        assert!(said.starts_with("frames 110 and 111 seem to be in the wrong order"), "{said}");
        // Two centimetres of trembling at walking pace, and a car that stops and reverses as hard as it can.
        let trembling: Vec<f64> =
            even.iter().enumerate().map(|(k, z)| 0.1 * z + 0.02 * (k % 2) as f64).collect();
        let reversing: Vec<f64> =
            (0..30).map(|k| f64::from(k) * 0.1).map(|t| 5.0 * t - 0.5 * 10.0 * t * t).collect();
        for way in [trembling, reversing] {
            let (frames, ego) = drive(&way);
            assert_eq!(of(&frames, &ego, &options), None);
        }
        // Bridged poses say nothing of the order.
        let (frames, mut ego) = drive(&swapped);
        ego[11].status = FrameStatus::Bridged;
        assert_eq!(of(&frames, &ego, &options), None);
    }
}
