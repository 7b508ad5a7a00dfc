//! Which way a vehicle points.

use nalgebra::{Point3, Vector3};

use crate::ground::GroundFrame;
use crate::motion::KinematicState;
use crate::single_view::locate;
use crate::trajectory::{ExternalView, TrafficSide};
use crate::views::{TrackInput, UNEXPLAINED};

/// A vehicle that is slower holds its heading: direction of travel means nothing at a stand \[m/s\].
pub(crate) const HOLD_HEADING_MPS: f64 = 1.5;

/// Headings relative to each frame's camera from given poses, held between them; `None` when none are given.
pub(crate) fn external_headings(
    grounds: &[GroundFrame],
    given: &[ExternalView],
    start: usize,
    count: usize,
) -> Option<Vec<f64>> {
    let world = |g: &ExternalView| grounds[g.frame].world_from_camera.transform_vector(&g.forward_in_camera);
    let heading = |k: usize| {
        // The mean of the nine nearest in time: single-view headings scatter by degrees, and flip now and then. Flipped ones
        // are turned to the one that most others agree with.
        let mut near: Vec<&ExternalView> = given.iter().collect();
        near.sort_by_key(|g| g.frame.abs_diff(start + k));
        near.truncate(9);
        let directions: Vec<Vector3<f64>> = near.iter().map(|g| world(g)).collect();
        let agreement = |d: &Vector3<f64>| directions.iter().map(|o| o.dot(d)).sum::<f64>();
        let medoid = directions.iter().max_by(|a, b| agreement(a).total_cmp(&agreement(b)))?;
        let sum: Vector3<f64> = directions.iter().map(|d| d * d.dot(medoid).signum()).sum();
        let ground = &grounds[start + k];
        Some(ground.heading_of(&ground.world_from_camera.inverse().transform_vector(&sum)))
    };
    (0..count).map(heading).collect()
}

/// Headings (relative to each frame's camera) from the direction of travel; held where the vehicle is slow.
pub(crate) fn headings_of_travel(
    states: &[KinematicState],
    grounds: &[GroundFrame],
    fallback: &[f64],
) -> Vec<f64> {
    let directions: Vec<Option<Vector3<f64>>> = states
        .iter()
        .map(|s| (s.velocity.norm() > HOLD_HEADING_MPS).then(|| s.velocity.normalize()))
        .collect();
    let nearest = |k: usize| {
        let order =
            (0..directions.len()).filter(|i| directions[*i].is_some()).min_by_key(|i| i.abs_diff(k))?;
        directions[order]
    };
    let heading = |k: usize| match nearest(k) {
        Some(d) => grounds[k].heading_of(&grounds[k].world_from_camera.inverse().transform_vector(&d)),
        None => fallback[k],
    };
    (0..states.len()).map(heading).collect()
}

/// Heading of a standing vehicle: the one whose boxes fit best from all sides it was seen from.
pub(crate) fn standing_headings(
    story: &TrackInput<'_>,
    states: &[KinematicState],
    side: TrafficSide,
) -> Vec<f64> {
    const STEPS: usize = 12;
    const VIEWS: usize = 12;
    let TrackInput { camera, grounds, track, prior, start, .. } = story;
    let every = track.boxes.len().div_ceil(VIEWS).max(1);
    let some: Vec<_> = track.boxes.iter().step_by(every).collect();
    let middle = &grounds[some[some.len() / 2].frame];
    let road = middle.world_from_camera.transform_vector(&middle.ahead());
    let local = |frame: usize, angle: f64| {
        // The same direction in the world, as this frame's camera sees it.
        let ground = &grounds[frame];
        let along = ground.world_from_camera.inverse().transform_vector(&road);
        ground.heading_of(&along) + angle
    };
    let misfit = |angle: f64| -> f64 {
        let one = |b: &&crate::tracker::TrackBox| {
            let view = locate(camera, &grounds[b.frame], &b.seen, local(b.frame, angle), prior)?;
            Some(view.misfit(prior).min(UNEXPLAINED))
        };
        // Most vehicles stand along the road, others across it, few in between, which boxes tell least of.
        let seldom = 2.0 * angle.sin().powi(2) + 2.0 * (2.0 * angle).sin().powi(2);
        some.iter().map(|b| one(b).unwrap_or(UNEXPLAINED)).sum::<f64>() + seldom
    };
    let angles = (0..STEPS).map(|k| std::f64::consts::PI * k as f64 / STEPS as f64);
    let best = angles.map(|a| (misfit(a), a)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |b| b.1);
    let fold = if best > std::f64::consts::FRAC_PI_2 { best - std::f64::consts::PI } else { best };
    // Which end is the front the box does not tell: as traffic on its side of the road drives.
    let position = states.first().map_or(Vector3::zeros(), |s| s.position);
    let seen = middle.world_from_camera.inverse().transform_point(&Point3::from(position));
    let to_the_left = seen.coords.dot(&middle.left()) > 2.0;
    let to_the_right = seen.coords.dot(&middle.left()) < -2.0;
    let oncoming = match side {
        TrafficSide::Right => to_the_left,
        TrafficSide::Left => to_the_right,
    };
    let front = if oncoming { fold + std::f64::consts::PI } else { fold };
    (0..states.len()).map(|k| local(*start + k, front)).collect()
}
