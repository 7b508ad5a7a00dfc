//! One vehicle's way through the world, from the boxes of its track.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::ground::GroundFrame;
use crate::headings::{external_headings, headings_of_travel, standing_headings};
use crate::motion::{KinematicState, PositionMeasurement, probability_moving, smooth_motion, standing_place};
use crate::size::size_prior;
use crate::states::assemble;
use crate::tracker::Track;
use crate::trajectory::{ExternalTrack, TrafficSide, VehicleTrajectory};
use crate::views::{TrackInput, Views};

/// Estimates a track from its boxes and from poses given for it (either may be empty). `None` when nothing of it can be
/// placed on the road.
///
/// Where nobody says which way the vehicle points, it is first taken to go along the road. When it then seems to move and its
/// boxes fit badly, a second story begins with the heading that fits them best: a car that stands across the road, taken for one
/// along it, is three times as near as it is and seems to move. The story counts whose boxes fit better in the end.
pub fn estimate_track(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    given: &ExternalTrack,
    side: TrafficSide,
) -> Option<VehicleTrajectory> {
    /// χ² by which boxes must fit better in the second story: most traffic goes along the road.
    const CLEARLY: f64 = 6.0;
    let frames = || track.boxes.iter().map(|b| b.frame).chain(given.views.iter().map(|g| g.frame));
    let (start, end) = (frames().min()?, frames().max()?);
    let times: Vec<f64> = grounds.get(start..=end)?.iter().map(|g| g.time_s).collect();
    let prior = given.size.unwrap_or_else(|| size_prior(track.class));
    let story = TrackInput { camera, grounds, track, given, prior, start };
    let pointed = external_headings(grounds, &given.views, start, times.len());
    let along = pointed.clone().unwrap_or_else(|| vec![0.0; times.len()]);
    let mut told = tell(&story, &times, pointed.as_deref(), along, side)?;
    if pointed.is_none() && told.p_moving > 0.5 && told.views.doubt > 1.0 {
        let across = standing_headings(&story, &told.states, side);
        let other = tell(&story, &times, None, across, side);
        told = other.filter(|o| o.views.misfit + CLEARLY < told.views.misfit).unwrap_or(told);
    }
    Some(VehicleTrajectory {
        id: track.id,
        class: track.class,
        size: told.views.size.size,
        size_covariance: told.views.size.covariance,
        p_moving: told.p_moving,
        states: assemble(&story, &told.views, &told.states, &told.headings),
    })
}

/// A vehicle's way as one beginning makes it.
struct TrackHypothesis {
    views: Views,
    states: Vec<KinematicState>,
    p_moving: f64,
    /// Relative to each frame's camera.
    headings: Vec<f64>,
}

/// Places, motion and headings in turn, from these headings on; `pointed` are those given for a vehicle that stands.
fn tell(
    story: &TrackInput<'_>,
    times: &[f64],
    pointed: Option<&[f64]>,
    begin: Vec<f64>,
    side: TrafficSide,
) -> Option<TrackHypothesis> {
    let grounds = story.grounds.get(story.start..story.start + times.len())?;
    let up = grounds[0].world_from_camera.transform_vector(&grounds[0].up);
    // Which way it stands is sought once: the boxes tell it, not where the vehicle was thought to be.
    let (mut told, mut parked): (Option<TrackHypothesis>, Option<Vec<f64>>) = (None, None);
    let mut headings = begin;
    for _ in 0..3 {
        let views = Views::of(story, &headings)?;
        let places = views.places(story.grounds);
        let p_moving = probability_moving(&places, views.doubt);
        let states = if p_moving > 0.5 {
            smooth_motion(&places, times, &up)
        } else {
            standing_states(&places, times.len())?
        };
        let before = headings;
        headings = if p_moving > 0.5 {
            headings_of_travel(&states, grounds, &before)
        } else if let Some(pointed) = pointed {
            pointed.to_vec()
        } else {
            parked.get_or_insert_with(|| standing_headings(story, &states, side)).clone()
        };
        told = Some(TrackHypothesis { views, states, p_moving, headings: headings.clone() });
        if headings == before {
            break;
        }
    }
    told
}

fn standing_states(places: &[PositionMeasurement], count: usize) -> Option<Vec<KinematicState>> {
    let (position, covariance) = standing_place(places)?;
    let mut full = Matrix6::zeros();
    full.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance);
    full.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * 0.05));
    Some(vec![KinematicState { position, velocity: Vector3::zeros(), covariance: full }; count])
}
