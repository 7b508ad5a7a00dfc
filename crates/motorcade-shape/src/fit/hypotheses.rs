//! Initial poses: headings over the circle, left and right as given and exchanged, each positioned linearly.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix3, Vector3};

use super::heading::frame_of_ray;
use super::model::{Model, Shape, State};
use super::observation::Observation;
use super::options::FitOptions;
use super::problem::{Problem, pose};
use super::solver::cost_of;

/// An initial pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hypothesis {
    pub state: State,
    pub swapped: bool,
    cost: f64,
}

/// Cosine between two headings.
pub(crate) fn heading_cosine(a: &State, b: &State) -> f64 {
    let forward = |s: &State| s.camera_from_vehicle.transform_vector(&Vector3::x());
    forward(a).dot(&forward(b))
}

/// Orientation of an upright vehicle: heading 0 drives away from the camera, positive turns left seen from above.
fn upright(up: &Vector3<f64>, heading_rad: f64) -> Matrix3<f64> {
    let (ahead, left) = frame_of_ray(up, &Vector3::z());
    let (sin, cos) = heading_rad.sin_cos();
    let forward = ahead * cos + left * sin;
    Matrix3::from_columns(&[forward, up.cross(&forward), *up])
}

/// The initial poses to refine, the most likely first; always one opposite to the most likely, when any is in front of the camera.
pub(crate) fn choose(
    model: &Model,
    camera: &PinholeCamera,
    options: &FitOptions,
    observation: &Observation,
    shape: &Shape,
) -> Vec<Hypothesis> {
    let mut all: Vec<Hypothesis> = Vec::new();
    let mut rows = Vec::new();
    let advanced = &options.advanced;
    let count = options.headings.max(4);
    for swapped in [false, true] {
        let mut problem = Problem::new(model, camera, options, observation, swapped);
        // The guess only weights the first linear round.
        let first_distance_m = advanced.first_distance_m(camera.focal_px(), problem.span_px());
        let up = problem.up();
        for k in 0..count {
            let rotation = upright(&up, k as f64 / count as f64 * std::f64::consts::TAU);
            problem.distance_m = first_distance_m;
            let at = |t: &Vector3<f64>| State { camera_from_vehicle: pose(&rotation, t), shape: *shape };
            let start = at(&Vector3::zeros());
            // Outliers can move the linear position behind the camera; then the first distance is used.
            let translation = problem
                .linear_translation(&rotation, &start)
                .unwrap_or_else(|| problem.position_at(first_distance_m));
            let state = at(&translation);
            problem.distance_m = translation.z;
            if !problem.rows(&state, &mut rows) {
                continue;
            }
            let cost = cost_of(&problem, &rows) + problem.discrete_cost(&state);
            all.push(Hypothesis { state, swapped, cost });
        }
    }
    all.sort_by(|a, b| a.cost.total_cmp(&b.cost));

    let Some(first) = all.first().copied() else { return all };
    let mut chosen = vec![first];
    chosen.extend(all.iter().find(|h| heading_cosine(&h.state, &first.state) < advanced.opposite_cosine));
    for hypothesis in &all {
        if chosen.len() >= options.refined.max(2) {
            break;
        }
        let near = |c: &Hypothesis| {
            c.swapped == hypothesis.swapped
                && heading_cosine(&c.state, &hypothesis.state) > advanced.same_cosine
        };
        if !chosen.iter().any(near) {
            chosen.push(*hypothesis);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upright_orientations_are_rotations_that_stand() {
        for up in [-Vector3::y(), Vector3::new(0.1, -1.0, 0.05).normalize(), Vector3::new(0.0, 0.0, -1.0)] {
            for heading in [0.0, 1.0, 3.0] {
                let r = upright(&up, heading);
                assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-12);
                assert!((r.determinant() - 1.0).abs() < 1e-12 && (r.column(2) - up).norm() < 1e-12);
            }
        }
        // Heading 0 drives away from the camera, its left is the image's left.
        let r = upright(&-Vector3::y(), 0.0);
        assert!((r.column(0) - Vector3::z()).norm() < 1e-12 && (r.column(1) + Vector3::x()).norm() < 1e-12);
    }
}
