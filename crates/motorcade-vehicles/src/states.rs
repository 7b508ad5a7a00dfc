//! The states of a vehicle, put together.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle, World};
use motorcade_perception::{BoundingBox, BoxConvention, VehicleClass};
use motorcade_shape::Dimensions;
use nalgebra::{Matrix3, Matrix6, Point3};

use crate::headings::HOLD_HEADING_MPS;
use crate::motion::KinematicState;
use crate::silhouette::{image_box, standing_pose};
use crate::trajectory::{Source, VehicleState};
use crate::views::{TrackInput, Views};

/// States of all frames from motion and headings (relative to each frame's camera).
pub(crate) fn assemble(
    story: &TrackInput<'_>,
    views: &Views,
    states: &[KinematicState],
    headings: &[f64],
) -> Vec<VehicleState> {
    let TrackInput { camera, grounds, track, given, start, .. } = *story;
    let sightings = views.sightings(story, headings);
    let mut out: Vec<VehicleState> = Vec::with_capacity(states.len());
    for (k, (state, heading)) in states.iter().zip(headings).enumerate() {
        let ground = &grounds[start + k];
        let camera_from_world = ground.world_from_camera.inverse();
        let position = camera_from_world.transform_point(&Point3::from(state.position));
        let forward = ground.direction_of(*heading);
        let camera_from_vehicle = standing_pose(&position, &forward, &ground.up);
        let world_from_vehicle = ground.world_from_camera * camera_from_vehicle;
        let found = track.boxes.iter().find(|b| b.frame == start + k);
        let direction = ground.world_from_camera.transform_vector(&forward);
        let speed_mps = state.velocity.dot(&direction);
        let velocity_covariance: Matrix3<f64> = state.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        let speed_sigma_mps = direction.dot(&(velocity_covariance * direction)).max(0.0).sqrt();
        let (yaw_rate_radps, dt) = match out.last() {
            Some(before) => {
                let turn = before.world_from_vehicle.rotation().inverse() * world_from_vehicle.rotation();
                let dt = (ground.time_s - grounds[start + k - 1].time_s).max(1e-3);
                (turn.scaled_axis().z / dt, dt)
            }
            None => (0.0, 0.1),
        };
        out.push(VehicleState {
            frame: start + k,
            world_from_vehicle,
            covariance: pose_covariance(state, &world_from_vehicle, speed_mps, dt),
            bbox: match found {
                Some(b) => Some(b.seen.bbox),
                None => projected(camera, &camera_from_vehicle, track.class, &views.size.size),
            },
            score: found.map_or(0.0, |b| b.score),
            speed_mps,
            speed_sigma_mps,
            yaw_rate_radps,
            source: match (found, given.views.iter().find(|g| g.frame == start + k)) {
                (_, Some(given)) => given.source,
                (Some(_), None) => Source::Box,
                (None, None) => Source::Predicted,
            },
            measured: views.measured(start + k, ground, &forward),
            sightings: sightings.iter().filter(|(frame, _)| *frame == start + k).map(|(_, s)| *s).collect(),
        });
    }
    out
}

fn projected(
    camera: &PinholeCamera,
    pose: &Pose<Camera, Vehicle>,
    class: VehicleClass,
    size: &Dimensions,
) -> Option<BoundingBox> {
    let bbox = image_box(camera, pose, class, BoxConvention::VisibleExtent, size)?
        .clipped(camera.width, camera.height);
    (bbox.width() > 1.0 && bbox.height() > 1.0).then_some(bbox)
}

fn pose_covariance(
    state: &KinematicState,
    world_from_vehicle: &Pose<World, Vehicle>,
    speed_mps: f64,
    dt: f64,
) -> Matrix6<f64> {
    let r = world_from_vehicle.rotation_matrix();
    let position: Matrix3<f64> = state.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let velocity: Matrix3<f64> = r.transpose() * state.covariance.fixed_view::<3, 3>(3, 3) * r;
    let mut out = Matrix6::zeros();
    // Upright within a degree or two; heading as sure as the direction of travel, at best 2°.
    let heading =
        (velocity[(1, 1)].max(0.0).sqrt() / speed_mps.abs().max(HOLD_HEADING_MPS)).max(2.0_f64.to_radians());
    out[(0, 0)] = 2.0_f64.to_radians().powi(2);
    out[(1, 1)] = 2.0_f64.to_radians().powi(2);
    out[(2, 2)] = heading.min(1.0).powi(2) + (0.01 * dt).powi(2);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r.transpose() * position * r));
    out
}
