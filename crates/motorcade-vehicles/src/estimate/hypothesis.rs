//! Estimate of a track from one initial set of headings.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::headings::{parked_headings, static_headings, travel_headings};
use super::input::TrackInput;
use super::off_road;
use super::views::Views;
use crate::box_fit::SingleView;
use crate::ground::GroundFrame;
use crate::motion::{
    KinematicState, PositionMeasurement, probability_moving, smooth_motion, static_position,
};
use crate::options::AdvancedVehicleOptions;
use crate::trajectory::Source;

/// Positions, motion and headings of a track.
pub(super) struct TrackHypothesis {
    pub(super) views: Views,
    pub(super) states: Vec<KinematicState>,
    pub(super) p_moving: f64,
    /// Relative to each frame's camera \[rad\].
    pub(super) headings: Vec<f64>,
    /// Variance of the headings by what all frames share \[rad²\]: of a standing vehicle whose direction was chosen.
    pub(super) heading_variance: f64,
}

impl TrackHypothesis {
    /// Alternates positions, motion and headings from these headings on. `external` are the headings of external views, which
    /// a static vehicle keeps. The vehicle stands or moves as `assumed`, or as is more probable. `start` holds earlier fits of the boxes, if any.
    pub(super) fn new(
        input: &TrackInput<'_>,
        times: &[f64],
        external: Option<&[f64]>,
        initial: Vec<f64>,
        assumed: Option<bool>,
        start: &[(usize, SingleView)],
    ) -> Option<Self> {
        let advanced = &input.options.advanced;
        let first = input.grounds.get(input.start)?;
        let up = first.world_from_camera.transform_vector(&first.up);
        // The orientation of a static vehicle is searched once: it follows from the boxes, not from the positions.
        let (mut found, mut parked): (Option<Self>, Option<(Vec<f64>, f64)>) = (None, None);
        let mut headings = initial;
        for _ in 0..advanced.hypothesis.rounds {
            let earlier = found.as_ref().map_or_else(|| start, |f: &Self| &f.views.boxes);
            let views = Views::new(input, &headings, earlier)?;
            let positions = views.positions(input.grounds);
            let forward = external.and_then(|headings| mean_forward(input, headings));
            let p_moving = probability_moving(&positions, forward.as_ref(), views.inflation, advanced)
                * off_road::factor(input, &positions);
            let moves = assumed.unwrap_or(p_moving > advanced.kinematic_state.moving_from);
            let states = if moves {
                smooth_motion(&positions, times, &up, advanced)
            } else {
                static_states(&positions, times.len(), advanced)?
            };
            let before = headings;
            let heading_variance;
            (headings, heading_variance) = if moves {
                (travel_headings(input, &states, views.size.size.length_m, &before), 0.0)
            } else {
                let search = || match external {
                    Some(external) if by_keypoints(input) => parked_headings(input, &states, external),
                    Some(external) => (external.to_vec(), 0.0),
                    None => static_headings(input, &states, &views.boxes),
                };
                parked.get_or_insert_with(search).clone()
            };
            found = Some(Self { views, states, p_moving, headings: headings.clone(), heading_variance });
            if headings == before {
                break;
            }
        }
        found
    }
}

/// True when headings come from a network's keypoints, not from a file of poses.
fn by_keypoints(input: &TrackInput<'_>) -> bool {
    input.external_headings.views.iter().any(|view| view.source == Source::Keypoints)
}

/// Mean forward direction in the world for headings relative to each frame's camera.
fn mean_forward(input: &TrackInput<'_>, headings: &[f64]) -> Option<Vector3<f64>> {
    let grounds = input.grounds.get(input.start..)?.iter();
    let forward = |(ground, heading): (&GroundFrame, &f64)| {
        ground.world_from_camera.transform_vector(&ground.direction_of(*heading))
    };
    grounds.zip(headings).map(forward).sum::<Vector3<f64>>().try_normalize(1e-6)
}

fn static_states(
    positions: &[PositionMeasurement],
    count: usize,
    options: &AdvancedVehicleOptions,
) -> Option<Vec<KinematicState>> {
    let (position, covariance) = static_position(positions, options)?;
    let mut full = Matrix6::zeros();
    full.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance);
    let velocity = Matrix3::identity() * options.motion.static_velocity_variance;
    full.fixed_view_mut::<3, 3>(3, 3).copy_from(&velocity);
    Some(vec![KinematicState { position, velocity: Vector3::zeros(), covariance: full }; count])
}
