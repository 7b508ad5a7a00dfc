//! Changes of the slope of a road, by the camera's own way over it.

use crate::ground::GroundFrame;
use crate::options::BoxFitOptions;

/// Way that counts as driven, far above what rounding leaves of running sums \[m\].
const LEAST_WAY_M: f64 = 0.1;

/// Sets [`GroundFrame::slope_change_sigma_rad`] of all frames of a drive, or of a window of it.
pub fn measure_slope_changes(grounds: &mut [GroundFrame], options: &BoxFitOptions) {
    for (frame, change_rad) in slope_changes(grounds, options).into_iter().enumerate() {
        grounds[frame].slope_change_sigma_rad = change_rad;
    }
}

/// Standard deviation of the change of the road's slope over [`BoxFitOptions::road_slope_length_m`] near each frame, as far as it exceeds that of streets: hills \[rad\].
/// The road under the camera a length further on lies off the plane of a frame by what its slope changed. Zero for frames without such a stretch.
fn slope_changes(grounds: &[GroundFrame], options: &BoxFitOptions) -> Vec<f64> {
    let length_m = options.road_slope_length_m;
    let mut way_m = Vec::with_capacity(grounds.len());
    let mut driven_m = 0.0;
    for (k, ground) in grounds.iter().enumerate() {
        if let Some(before) = k.checked_sub(1) {
            let before = grounds[before].world_from_camera.translation();
            driven_m += (ground.world_from_camera.translation() - before).norm();
        }
        way_m.push(driven_m);
    }
    // Middle, weight and squared change of slope over a length of each stretch. A frame counts by the way to the next one: those of a camera that
    // stands are one.
    let mut end = 0;
    let mut stretches: Vec<[f64; 3]> = Vec::new();
    for (k, ground) in grounds.iter().enumerate() {
        while end < grounds.len() && way_m[end] < way_m[k] + length_m {
            end += 1;
        }
        let Some(last) = grounds.get(end) else { break };
        if let Some(squared) = squared_excess(ground, last, options) {
            let weight_m = way_m[k + 1] - way_m[k];
            stretches.push([0.5 * (way_m[k] + way_m[end]), weight_m, squared]);
        }
    }
    let reach_m = length_m * options.road_slope_most_lengths;
    let (mut from, mut to) = (0, 0);
    let (mut weight_m, mut sum) = (0.0, 0.0);
    let mut changes_rad = Vec::with_capacity(grounds.len());
    for at_m in &way_m {
        while let Some([_, weight, squared]) = stretches.get(to).filter(|s| s[0] <= at_m + reach_m) {
            weight_m += weight;
            sum += weight * squared;
            to += 1;
        }
        while let Some([_, weight, squared]) = stretches[from..to].first().filter(|s| s[0] < at_m - reach_m) {
            weight_m -= weight;
            sum -= weight * squared;
            from += 1;
        }
        let known = weight_m > LEAST_WAY_M;
        changes_rad.push(if known { (sum / weight_m).max(0.0).sqrt() } else { 0.0 });
    }
    changes_rad
}

/// Squared change of slope over a length by the road under a later camera \[rad²\], less what pitch, cross-fall and the slopes of streets explain; negative
/// on level roads. `None` where the way turns aside.
fn squared_excess(ground: &GroundFrame, later: &GroundFrame, options: &BoxFitOptions) -> Option<f64> {
    let centre = later.world_from_camera.translation().into();
    let place = ground.world_from_camera.inverse().transform_point(&centre).coords;
    let (ahead_m, left_m) = (place.dot(&ground.ahead()), place.dot(&ground.left()));
    // A camera's height over the road is that over the plane under itself.
    let above_m = place.dot(&ground.up) + ground.height_m - later.height_m;
    if left_m.abs() > ahead_m {
        return None;
    }
    let explained = options
        .road_height_sigma_m
        .hypot(ground.pitch_sigma_rad * ahead_m)
        .hypot(options.level_sigma_m(left_m));
    let arm_m = ahead_m * options.slope_lengths(ahead_m);
    Some((above_m.powi(2) - explained.powi(2)) / arm_m.powi(2) - options.road_slope_sigma_rad.powi(2))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

    /// A camera over a road of constant vertical curvature \[1/m\], half a metre a frame.
    pub(crate) fn drive(curvature_per_m: f64, frames: u32) -> Vec<GroundFrame> {
        after_level(0, curvature_per_m, frames)
    }

    /// The same after so many frames of level road.
    pub(crate) fn after_level(level: u32, curvature_per_m: f64, frames: u32) -> Vec<GroundFrame> {
        let ground = |k: u32| {
            let way_m = 0.5 * f64::from(k.saturating_sub(level));
            let angle_rad = way_m * curvature_per_m;
            let up_m = 0.5 * curvature_per_m * way_m * way_m;
            GroundFrame {
                // y points down, a positive curvature leads up.
                world_from_camera: Pose::new(Isometry3::from_parts(
                    Translation3::new(0.0, -up_m, 0.5 * f64::from(k)),
                    UnitQuaternion::from_euler_angles(angle_rad, 0.0, 0.0),
                )),
                up: -Vector3::y(),
                height_m: 1.65,
                pitch_sigma_rad: 1e-3,
                slope_change_sigma_rad: 0.0,
                road_ahead: None,
                time_s: 0.1 * f64::from(k),
            }
        };
        (0..frames).map(ground).collect()
    }

    #[test]
    fn a_level_road_stays_as_stated_and_a_crest_widens_it() {
        let options = BoxFitOptions::default();
        let measured =
            |curvature_per_m: f64, frames: u32| slope_changes(&drive(curvature_per_m, frames), &options);
        assert!(measured(0.0, 100).iter().all(|change| *change == 0.0));
        // A radius of 200 m leaves the plane by 1 m in 20 m: a slope of 0.05 over one length.
        for change in measured(-1.0 / 200.0, 100) {
            assert!((change - 0.05).abs() < 0.005, "{change}");
        }
        // A way shorter than one length says nothing.
        assert!(measured(-1.0 / 200.0, 30).iter().all(|change| *change == 0.0));
        // A crest that is far away does not count.
        let changes = slope_changes(&after_level(400, -1.0 / 200.0, 500), &options);
        assert_eq!(changes[100], 0.0);
        assert!(changes[450] > 0.02);
    }
}
