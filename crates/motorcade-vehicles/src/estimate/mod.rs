//! Trajectory of one vehicle from the boxes of its track and its external views.

mod headings;
mod hypothesis;
mod input;
mod measurements;
mod states;
mod views;

use motorcade_geometry::PinholeCamera;

use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::options::VehicleOptions;
use crate::size_prior::size_prior;
use crate::track::Track;
use crate::trajectory::VehicleTrajectory;
use headings::{external_headings, static_headings};
use hypothesis::TrackHypothesis;
use input::TrackInput;
use states::assemble;

/// Estimates a track from its boxes and its external views (either may be empty). `None` when none of them can be placed on the
/// road.
///
/// Without external headings the vehicle is first assumed to point along the road. When it then appears to move and its boxes
/// fit badly, a second hypothesis is evaluated with the heading that fits them best: a car across the road, assumed along it,
/// is placed too near and appears to move. The hypothesis with the clearly smaller χ² is kept.
pub fn estimate_track(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    external: &ExternalTrack,
    options: &VehicleOptions,
) -> Option<VehicleTrajectory> {
    let frames = || track.boxes.iter().map(|b| b.frame).chain(external.views.iter().map(|v| v.frame));
    let (start, end) = (frames().min()?, frames().max()?);
    let times: Vec<f64> = grounds.get(start..=end)?.iter().map(|g| g.time_s).collect();
    let prior = external.size.unwrap_or_else(|| size_prior(track.class));
    let input = TrackInput { camera, grounds, track, external, prior, start, options };
    let given = external_headings(&input, times.len());
    let initial = given.clone().unwrap_or_else(|| vec![0.0; times.len()]);
    let mut best = TrackHypothesis::new(&input, &times, given.as_deref(), initial)?;
    if given.is_none() && best.p_moving > 0.5 && best.views.inflation > 1.0 {
        let headings = static_headings(&input, &best.states, options.traffic_side);
        let preference = options.advanced.hypothesis.preference_chi2;
        let second = TrackHypothesis::new(&input, &times, None, headings);
        best = second.filter(|s| s.views.chi2 + preference < best.views.chi2).unwrap_or(best);
    }
    Some(VehicleTrajectory {
        id: track.id,
        class: track.class,
        size: best.views.size.size,
        size_covariance: best.views.size.covariance,
        p_moving: best.p_moving,
        states: assemble(&input, &best.views, &best.states, &best.headings),
    })
}
