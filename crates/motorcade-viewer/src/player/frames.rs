//! The camera in every frame.

use motorcade::{Config, RunResult};
use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Matrix2, Matrix6, Vector3};
use serde_json::{Value, json};

use super::rounded;
use crate::speed::times_s;
use crate::strip;

/// Columns with a value a frame.
pub(super) fn frames(result: &RunResult, config: &Config) -> Value {
    let ego = &result.ego.frames;
    let column = |value: &dyn Fn(usize) -> f64, digits| -> Vec<f64> {
        (0..ego.len()).map(|k| rounded(value(k), digits)).collect()
    };
    let speeds = motorcade::speeds(result, config);
    let speed = |k: usize| speeds.get(k).map(|row| row.speed_mps);
    // Time gap to the vehicle in the path of the camera.
    let ahead = |k: usize| {
        let ahead = speeds.get(k)?.ahead.as_ref()?;
        Some((ahead.id, ahead.time_gap_s?))
    };
    let at = |k: usize| ego[k].world_from_camera.translation();
    let covariance = |k: usize| on_map(&ego[k].world_from_camera, &ego[k].covariance);
    let forward = |k: usize| ego[k].world_from_camera.rotation_matrix() * Vector3::z();
    let mut way = 0.0;
    let way: Vec<f64> = (0..ego.len())
        .map(|k| {
            way += if k > 0 { (at(k) - at(k - 1)).norm() } else { 0.0 };
            rounded(way, 2)
        })
        .collect();
    json!({
        "number": result.frames.iter().map(|f| f.number).collect::<Vec<_>>(),
        "time": times_s(result).into_iter().map(|t| rounded(t, 3)).collect::<Vec<_>>(),
        "status": (0..ego.len()).map(|k| strip::kind(result, k)).collect::<Vec<_>>(),
        "statuses": strip::KINDS.map(|(_, words)| words),
        "x": column(&|k| at(k).x, 2),
        "z": column(&|k| at(k).z, 2),
        "yaw": column(&|k| forward(k).x.atan2(forward(k).z), 3),
        "xx": column(&|k| covariance(k)[(0, 0)], 3),
        "xz": column(&|k| covariance(k)[(0, 1)], 3),
        "zz": column(&|k| covariance(k)[(1, 1)], 3),
        "speed": column(&|k| speed(k).map_or(f64::NAN, |s| s.value), 2),
        "speed_sigma": column(&|k| speed(k).map_or(f64::NAN, |s| s.sigma), 3),
        "way": way,
        "ahead": (0..ego.len()).map(|k| ahead(k).map(|(id, _)| id)).collect::<Vec<_>>(),
        "gap": column(&|k| ahead(k).map_or(f64::NAN, |(_, gap)| gap.value), 2),
        "gap_sigma": column(&|k| ahead(k).map_or(f64::NAN, |(_, gap)| gap.sigma), 2),
    })
}

/// Covariance of the position on the map (x right, z forward of the world) \[m²\].
fn on_map(pose: &Pose<World, Camera>, covariance: &Matrix6<f64>) -> Matrix2<f64> {
    let r = pose.rotation_matrix();
    let world = r * covariance.fixed_view::<3, 3>(3, 3) * r.transpose();
    Matrix2::new(world[(0, 0)], world[(0, 2)], world[(2, 0)], world[(2, 2)])
}
