//! Height of the road along the way.

use motorcade::RunResult;
use motorcade_odometry::EgoFrame;
use nalgebra::Vector3;

use crate::chart::{Across, Chart, Series};

/// The road below the camera, over the distance driven, relative to the plane of the road at the first frame.
pub(crate) fn elevation(result: &RunResult) -> String {
    let Some(first) = result.ego.frames.first() else { return String::new() };
    let up = first.world_from_camera.rotation_matrix() * first.road_normal;
    let below = |frame: &EgoFrame| below(frame, result.ego.height_m);
    let start = below(first);
    let (mut way_m, mut before) = (0.0, first.world_from_camera.translation());
    let (mut values, mut sigmas) = (Vec::new(), Vec::new());
    for frame in &result.ego.frames {
        let at = frame.world_from_camera.translation();
        way_m += (at - before).norm();
        before = at;
        let away = below(frame) - start;
        values.push((way_m, away.dot(&up)));
        sigmas.push(sigma_m(first, frame, &away, &up));
    }
    let series = vec![Series {
        name: "road below the camera ± σ".to_owned(),
        class: "camera",
        hue: None,
        vehicle: None,
        values,
        sigmas,
    }];
    let title = "Elevation of the road along the way, above its plane at the first frame";
    let chart = Chart {
        title,
        label: "elevation [m]",
        unit: "m",
        least: 2.0,
        from_zero: true,
        across: Across::Way,
        series,
    };
    chart.figure()
}

/// The point of the road below the camera, in the world \[m\].
fn below(frame: &EgoFrame, height_m: f64) -> Vector3<f64> {
    frame.world_from_camera.translation()
        - frame.world_from_camera.rotation_matrix() * frame.road_normal * height_m
}

/// Standard deviation of the elevation: of the camera's position, and of the tilt of the first plane at this distance.
fn sigma_m(first: &EgoFrame, frame: &EgoFrame, away: &Vector3<f64>, up: &Vector3<f64>) -> f64 {
    let r = frame.world_from_camera.rotation_matrix();
    let position = r * frame.covariance.fixed_view::<3, 3>(3, 3) * r.transpose();
    // A tilt by pitch or roll lifts a point by its distance forward or to the side.
    let local = first.world_from_camera.rotation_matrix().transpose() * away;
    let tilt = |k: usize| first.road_tilt_covariance[(k, k)].max(0.0);
    (up.dot(&(position * up)).max(0.0) + tilt(0) * local.z.powi(2) + tilt(1) * local.x.powi(2)).sqrt()
}
