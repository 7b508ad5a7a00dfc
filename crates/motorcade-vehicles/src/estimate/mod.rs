//! Trajectory of one vehicle from the boxes of its track and its external views.

mod background;
mod class;
mod consistency;
mod drive;
mod explanation;
mod headings;
mod hypothesis;
mod input;
mod measurements;
mod nearest;
mod off_road;
mod parted;
mod parts;
mod states;
mod undecided;
mod views;

use motorcade_geometry::PinholeCamera;
use motorcade_perception::VehicleClass;

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

pub use class::{SizeOfClass, sizes_by_class};
pub use explanation::explain_boxes;
pub use parted::join_parted;
pub use parts::estimate_consistently;

/// Estimates a track from its boxes and its external views (either may be empty). `None` when none of them can be placed on the
/// road.
///
/// Without external headings the vehicle is first assumed to point along the road. When it then appears to move and its boxes
/// fit badly, a second hypothesis is evaluated with the heading that fits them best: a car across the road, assumed along it,
/// is placed too near and appears to move. The hypothesis with the clearly smaller χ² is kept.
///
/// Where the detector's votes on the class disagree, or the boxes fit a vehicle of that class badly, the other classes are tried
/// too: a van that is called a car is placed too near by its size.
///
/// The states are those of the more probable one of two hypotheses, that the vehicle stands or moves, and have the other one beside them.
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
    let sizes = &options.advanced.size;
    let prior = external.size.unwrap_or_else(|| sizes.prior(track.class));
    let input =
        TrackInput { camera, grounds, track, external, external_headings: external, prior, start, options };
    let best = best_headings(&input, &times)?;
    // Compared on the same data: positions and sizes of external views follow from the shape of a car, their headings do not.
    let none = ExternalTrack::default();
    let cost_as = |class: VehicleClass| {
        let track = track.as_class(class);
        let input = TrackInput { track: &track, external: &none, prior: sizes.prior(class), ..input };
        let found = best_headings(&input, &times)?;
        let vehicle = trajectory(&input, &times, &found);
        Some((class_cost(&input, &found), found, vehicle))
    };
    let own = if doubtful(&input, &best) { cost_as(track.class) } else { None };
    let preference = options.advanced.hypothesis.class_preference_chi2;
    let better = own.and_then(|own| {
        let others = class::others(&track.votes, track.class, &options.advanced.class).into_iter();
        let others = others.filter_map(|class| cost_as(class).filter(|of| is_typical(&of.1, class, options)));
        others.filter(|of| of.0 + preference < own.0).min_by(|a, b| a.0.total_cmp(&b.0))
    });
    // The size by the road is that of a vehicle of the detector's class: it is linear in the size only near the right one, and the height of the
    // camera is found by what is called a car.
    let size_by_road = best.views.size_by_road;
    let found = better.map_or_else(|| trajectory(&input, &times, &best), |(_, _, found)| found);
    Some(VehicleTrajectory { size_by_road, ..found })
}

/// True when a size lies within the usual range of its class. What fits only as an unusually small lorry is none.
fn is_typical(found: &TrackHypothesis, class: VehicleClass, options: &VehicleOptions) -> bool {
    let prior = size_prior(class);
    let difference = found.views.size.size.to_vector() - prior.mean.to_vector();
    difference.component_div(&prior.sigma.to_vector()).amax()
        <= options.advanced.hypothesis.typical_size_sigmas
}

/// True when the detector's class may be wrong: its votes disagree, or the boxes fit it badly.
fn doubtful(input: &TrackInput<'_>, best: &TrackHypothesis) -> bool {
    let hypothesis = &input.options.advanced.hypothesis;
    let agreed = input.track.votes.shares().map_or(1.0, |shares| shares.into_iter().fold(0.0, f64::max));
    agreed < hypothesis.agreed_class_share || best.views.inflation > 1.0
}

/// Twice the negative logarithm of a class's probability, up to a constant.
fn class_cost(input: &TrackInput<'_>, found: &TrackHypothesis) -> f64 {
    let prior = class::log_prior(&input.track.votes, input.track.class, &input.options.advanced.class);
    class::cost(input, found) - 2.0 * prior.unwrap_or(0.0)
}

/// The estimate with the better of two sets of headings.
fn best_headings(input: &TrackInput<'_>, times: &[f64]) -> Option<TrackHypothesis> {
    let options = input.options;
    let given = external_headings(input, times.len());
    let initial = given.clone().unwrap_or_else(|| vec![0.0; times.len()]);
    let best = TrackHypothesis::new(input, times, given.as_deref(), initial, None, &[])?;
    let stands = best.p_moving <= options.advanced.kinematic_state.moving_from;
    if given.is_some() || stands || best.views.inflation <= 1.0 {
        return Some(best);
    }
    let (headings, _) = static_headings(input, &best.states, &best.views.boxes);
    let preference = options.advanced.hypothesis.preference_chi2;
    let second = TrackHypothesis::new(input, times, None, headings, None, &best.views.boxes);
    Some(second.filter(|s| s.views.chi2 + preference < best.views.chi2).unwrap_or(best))
}

fn trajectory(input: &TrackInput<'_>, times: &[f64], best: &TrackHypothesis) -> VehicleTrajectory {
    let probable = trajectory_of(input, best);
    match undecided::rival(input, times, best) {
        Some(rival) => undecided::with_rival(probable, &trajectory_of(input, &rival).states),
        None => probable,
    }
}

fn trajectory_of(input: &TrackInput<'_>, best: &TrackHypothesis) -> VehicleTrajectory {
    let (views, track, classes) = (&best.views, input.track, &input.options.advanced.class);
    let spread = class::spread(&track.votes, track.class, views.size_by_road.as_ref(), classes);
    let d = views.size.size.to_vector();
    VehicleTrajectory {
        id: input.track.id,
        class: input.track.class,
        size: best.views.size.size,
        size_covariance: views.size.covariance + d * d.transpose() * spread,
        size_by_road: best.views.size_by_road,
        p_moving: best.p_moving,
        states: assemble(input, &best.views, &best.states, (&best.headings, best.heading_variance)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, track_of};
    use crate::{image_box, options::SizeOptions};
    use motorcade_perception::BoxConvention;
    use motorcade_shape::Dimensions;

    /// A car a tenth larger than most, 20 m ahead: ground contact has it there, the height of its box a tenth nearer.
    #[test]
    fn each_cue_of_the_distance_is_switched_off_alone() {
        let mut car = car_ahead(1, 0.0, 20.0);
        let size = Dimensions::from_vector(&(car.size.to_vector() * 1.1));
        let grounds = level_grounds(10);
        for state in &mut car.states {
            let pose = grounds[state.frame].world_from_camera.inverse() * state.world_from_vehicle;
            state.bbox = image_box(&CAMERA, &pose, car.class, BoxConvention::VisibleExtent, &size);
        }
        let track = track_of(&car, [true; 4]);
        let ahead_m = |set: &dyn Fn(&mut VehicleOptions)| {
            let mut options = VehicleOptions::default();
            set(&mut options);
            let found = estimate_track(&CAMERA, &grounds, &track, &ExternalTrack::default(), &options);
            found.unwrap().states[5].world_from_vehicle.translation().z
        };
        let all = ahead_m(&|_| ());
        let without_size =
            ahead_m(&|o| o.advanced.size = SizeOptions { prior_factor: 10.0, ..o.advanced.size });
        let without_ground = ahead_m(&|o| o.advanced.box_fit.road_height_sigma_m = 100.0);
        assert!((without_size - 20.0).abs() < 0.2, "{without_size}");
        assert!((without_ground - 20.0 / 1.1).abs() < 0.4, "{without_ground}");
        assert!((without_ground..without_size).contains(&all), "{all}");
        // The size that the frames agree on is nearer to that of this car than the class is.
        let alone = ahead_m(&|o| o.advanced.size.shared = false);
        assert!(alone < all - 0.1, "{alone} {all}");
    }
}
