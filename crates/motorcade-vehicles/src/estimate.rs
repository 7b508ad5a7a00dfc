//! One vehicle's way through the world, from the boxes of its track.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::ground::GroundFrame;
use crate::headings::{given_headings, headings_of_travel, standing_headings};
use crate::motion::{Moving, Place, probability_moving, smooth_motion, standing_place};
use crate::size::size_prior;
use crate::states::assemble;
use crate::tracker::Track;
use crate::trajectory::{GivenTrack, TrafficSide, VehicleTrajectory};
use crate::views::{Story, Views};

/// Estimates a track from its boxes and from poses given for it (either may be empty). `None` when nothing of it can be
/// placed on the road.
pub fn estimate_track(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    given: &GivenTrack,
    side: TrafficSide,
) -> Option<VehicleTrajectory> {
    let frames = || track.boxes.iter().map(|b| b.frame).chain(given.views.iter().map(|g| g.frame));
    let (start, end) = (frames().min()?, frames().max()?);
    let times: Vec<f64> = grounds.get(start..=end)?.iter().map(|g| g.time_s).collect();
    let prior = given.size.unwrap_or_else(|| size_prior(track.class));
    let story = Story { camera, grounds, track, given, prior, start };
    // The direction given, or the road's, to begin with; then the vehicle's own.
    let pointed = given_headings(grounds, &given.views, start, times.len());
    let mut headings = pointed.clone().unwrap_or_else(|| vec![0.0; times.len()]);
    // Which way it stands is sought once: the boxes tell it, not where the vehicle was thought to be.
    let (mut estimate, mut parked) = (None, None);
    for _ in 0..3 {
        let views = Views::of(&story, &headings)?;
        let places = views.places(grounds);
        let up = grounds[start].world_from_camera.transform_vector(&grounds[start].up);
        let p_moving = probability_moving(&places);
        let states = if p_moving > 0.5 {
            smooth_motion(&places, &times, &up)
        } else {
            standing_states(&places, times.len())?
        };
        let before = std::mem::take(&mut headings);
        headings = if p_moving > 0.5 {
            headings_of_travel(&states, &grounds[start..=end], &before)
        } else if let Some(pointed) = &pointed {
            pointed.clone()
        } else {
            parked.get_or_insert_with(|| standing_headings(&story, &states, side)).clone()
        };
        estimate = Some((views, states, p_moving));
        if headings == before {
            break;
        }
    }
    let (views, states, p_moving) = estimate?;
    Some(VehicleTrajectory {
        id: track.id,
        class: track.class,
        size: views.size.size,
        size_covariance: views.size.covariance,
        p_moving,
        states: assemble(&story, &views, &states, &headings),
    })
}

fn standing_states(places: &[Place], count: usize) -> Option<Vec<Moving>> {
    let (position, covariance) = standing_place(places)?;
    let mut full = Matrix6::zeros();
    full.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance);
    full.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * 0.05));
    Some(vec![Moving { position, velocity: Vector3::zeros(), covariance: full }; count])
}
