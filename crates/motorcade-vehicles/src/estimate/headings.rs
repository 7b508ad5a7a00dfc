//! Headings of a vehicle, relative to each frame's camera.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use super::input::{TrackInput, fit_in_frame};
use crate::box_fit::SingleView;
use crate::external::ExternalView;
use crate::ground::GroundFrame;
use crate::motion::KinematicState;
use crate::options::TrafficSide;
use crate::time::{frame_interval_s, times_s};
use crate::track::TrackBox;

/// Headings from external views, averaged over the nearest in time; `None` when there are none. Reversed views are turned to the
/// medoid.
pub(super) fn external_headings(input: &TrackInput<'_>, count: usize) -> Option<Vec<f64>> {
    let (grounds, views) = (input.grounds, &input.external_headings.views);
    let options = &input.options.advanced.heading;
    let times = times_s(grounds.get(input.start..input.start + count)?);
    let interval_s = frame_interval_s(&times).unwrap_or(options.averaging_time_s);
    let in_time = ((options.averaging_time_s / interval_s).round() as usize).max(1);
    let every = in_time.div_ceil(options.averaged_views.max(1));
    let world: Vec<Vector3<f64>> = views
        .iter()
        .map(|v| grounds[v.frame].world_from_camera.transform_vector(&v.forward_in_camera))
        .collect();
    let heading = |k: usize| {
        let nearest = nearest_views(views, input.start + k, in_time);
        let directions: Vec<&Vector3<f64>> = nearest.iter().step_by(every).map(|i| &world[*i]).collect();
        let agreement = |d: &Vector3<f64>| directions.iter().map(|o| o.dot(d)).sum::<f64>();
        let medoid = directions.iter().max_by(|a, b| agreement(a).total_cmp(&agreement(b)))?;
        let sum: Vector3<f64> = directions.iter().map(|d| *d * d.dot(medoid).signum()).sum();
        let ground = &grounds[input.start + k];
        Some(ground.heading_of(&ground.world_from_camera.inverse().transform_vector(&sum)))
    };
    (0..count).map(heading).collect()
}

/// Indices of the `count` views nearest to a frame, nearest first, the earlier of two equally near. Views are in order of frames.
fn nearest_views(views: &[ExternalView], frame: usize, count: usize) -> Vec<usize> {
    let mut after = views.partition_point(|v| v.frame < frame);
    let mut before = after;
    let mut out = Vec::with_capacity(count.min(views.len()));
    while out.len() < count {
        let distance = |v: &ExternalView| v.frame.abs_diff(frame);
        let (earlier, later) = (before.checked_sub(1).and_then(|i| views.get(i)), views.get(after));
        let take_earlier = match (earlier, later) {
            (Some(e), Some(l)) => distance(e) <= distance(l),
            (Some(_), None) => true,
            (None, Some(_)) => false,
            (None, None) => break,
        };
        if take_earlier {
            before -= 1;
            out.push(before);
        } else {
            out.push(after);
            after += 1;
        }
    }
    out
}

/// Headings from the direction of travel, held where the vehicle is slow; `fallback` when it is always slow. The rear axle of a vehicle of this length moves
/// along its heading, its middle does not where it turns.
pub(super) fn travel_headings(
    input: &TrackInput<'_>,
    states: &[KinematicState],
    length_m: f64,
    fallback: &[f64],
) -> Vec<f64> {
    let options = &input.options.advanced.heading;
    let moves = |s: &KinematicState| s.velocity.norm() > options.hold_speed_mps;
    let travel: Vec<Option<Vector3<f64>>> =
        states.iter().map(|s| moves(s).then(|| s.velocity.normalize())).collect();
    let rear_axle_m = options.rear_axle_share * length_m;
    let forward = |k: usize| {
        let direction = travel[k]?;
        let ground = &input.grounds[input.start + k];
        let up = ground.world_from_camera.transform_vector(&ground.up);
        let yaw_rate_radps = yaw_rate_radps(input, &travel, states, k, &up);
        // Of its speed the middle, a distance a ahead of the axle, has a ω to the left of the heading.
        let slip_rad = (rear_axle_m * yaw_rate_radps / states[k].velocity.norm()).clamp(-1.0, 1.0).asin();
        Some(Rotation3::from_axis_angle(&Unit::new_normalize(up), -slip_rad) * direction)
    };
    let directions: Vec<Option<Vector3<f64>>> = (0..states.len()).map(forward).collect();
    let heading = |(k, nearest): (usize, Option<usize>)| match nearest.and_then(|i| directions[i]) {
        Some(d) => {
            let ground = &input.grounds[input.start + k];
            ground.heading_of(&ground.world_from_camera.inverse().transform_vector(&d))
        }
        None => fallback[k],
    };
    nearest_known(&directions).into_iter().enumerate().map(heading).collect()
}

/// Rate at which a direction of travel turns to the left about `up`, over half the averaging time before and after a state, the less of it the less certain it
/// is (Wiener's factor ω² / (ω² + σ²)); 0 where it is not known there.
fn yaw_rate_radps(
    input: &TrackInput<'_>,
    travel: &[Option<Vector3<f64>>],
    states: &[KinematicState],
    at: usize,
    up: &Vector3<f64>,
) -> f64 {
    let time_s = |k: usize| input.grounds[input.start + k].time_s;
    let half_s = 0.5 * input.options.advanced.heading.averaging_time_s;
    let near = |k: &usize| (time_s(*k) - time_s(at)).abs() <= half_s && travel[*k].is_some();
    let first = (0..=at).rev().take_while(near).last();
    let last = (at..travel.len()).take_while(near).last();
    let turn_rad = |from: usize, to: usize| {
        let (a, b) = (travel[from]?, travel[to]?);
        Some(up.dot(&a.cross(&b)).atan2(a.dot(&b)))
    };
    // Variance of a direction: that of the velocity across it.
    let variance = |k: usize| {
        let (velocity, across) = (states[k].velocity, up.cross(&travel[k].unwrap_or_default()));
        let covariance = states[k].covariance.fixed_view::<3, 3>(3, 3);
        across.dot(&(covariance * across)) / velocity.norm_squared()
    };
    let ends = first.zip(last).filter(|(from, to)| from < to);
    let rate = |(from, to): (usize, usize)| {
        let squared = turn_rad(from, to)?.powi(2);
        let certain = squared / (squared + variance(from) + variance(to)).max(f64::MIN_POSITIVE);
        Some(certain * turn_rad(from, to)? / (time_s(to) - time_s(from)))
    };
    ends.and_then(rate).unwrap_or(0.0)
}

/// For each entry the index of the nearest that is known, the earlier of two equally near.
fn nearest_known<T>(values: &[Option<T>]) -> Vec<Option<usize>> {
    let known = |i: usize| values[i].is_some().then_some(i);
    let mut before: Vec<Option<usize>> = Vec::with_capacity(values.len());
    for i in 0..values.len() {
        before.push(known(i).or_else(|| before.last().copied().flatten()));
    }
    let mut after = None;
    for i in (0..values.len()).rev() {
        after = known(i).or(after);
        before[i] = match (before[i], after) {
            (Some(b), Some(a)) if a - i < i - b => Some(a),
            (b, a) => b.or(a),
        };
    }
    before
}

/// Headings of a static vehicle: the orientation whose boxes fit best over all viewing directions, facing as the traffic of its
/// side of the road does. With their common variance \[rad²\]: of the orientation, and of the front, which boxes do not tell.
pub(super) fn static_headings(
    input: &TrackInput<'_>,
    states: &[KinematicState],
    earlier: &[(usize, SingleView)],
) -> (Vec<f64>, f64) {
    let options = &input.options.advanced.heading;
    let boxes = &input.track.boxes;
    let every = boxes.len().div_ceil(options.compared_boxes).max(1);
    let compared: Vec<&TrackBox> = boxes.iter().step_by(every).collect();
    let frame = |b: Option<&&TrackBox>| b.map_or(0, |b| b.frame);
    let span = (frame(compared.first()), frame(compared.last()));
    // Boxes of one correlation time share their error, and count as one against the prior of the orientation.
    let weight = input.independent_views(compared.len(), span, f64::MAX) / compared.len().max(1) as f64;
    let Some(middle) = compared.get(compared.len() / 2).and_then(|b| input.grounds.get(b.frame)) else {
        return (vec![0.0; states.len()], 0.0);
    };
    let road = middle.world_from_camera.transform_vector(&middle.ahead());
    // The same direction in the world, relative to this frame's camera.
    let local = |frame: usize, angle: f64| {
        let ground = &input.grounds[frame];
        let along = ground.world_from_camera.inverse().transform_vector(&road);
        ground.heading_of(&along) + angle
    };
    let saturation = input.options.advanced.box_fit.saturation_chi2;
    let information = input.prior.information();
    let chi2 = |angle: f64| -> f64 {
        let one = |b: &&TrackBox| {
            let fit = input.box_fit(&input.grounds[b.frame]);
            let start = fit_in_frame(earlier, b.frame);
            let view = fit.locate_sized(
                &b.observed,
                local(b.frame, angle),
                (&input.prior.mean, &information),
                start,
            )?;
            Some(view.chi2_with_size(&input.prior).min(saturation))
        };
        // Prior of the orientation: along the road, else across it, seldom oblique.
        let prior =
            options.across_cost * angle.sin().powi(2) + options.oblique_cost * (2.0 * angle).sin().powi(2);
        weight * compared.iter().map(|b| one(b).unwrap_or(saturation)).sum::<f64>() + prior
    };
    let count = options.orientations;
    let tried: Vec<(f64, f64)> =
        (0..count).map(|k| PI * k as f64 / count as f64).map(|a| (chi2(a), a)).collect();
    let (least, best) = tried.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
    let folded = if best > FRAC_PI_2 { best - PI } else { best };
    let (mut sum, mut squares) = (0.0, 0.0);
    for (chi2, angle) in tried {
        let weight = (0.5 * (least - chi2)).exp();
        let off = (angle - best + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
        (sum, squares) = (sum + weight, squares + weight * off * off);
    }
    let variance = squares / sum.max(1.0) + options.reversed_share * PI * PI;
    // A box does not distinguish front from rear.
    let position = states.first().map_or(Vector3::zeros(), |s| s.position);
    let in_camera = middle.world_from_camera.inverse().transform_point(&Point3::from(position));
    let left_m = in_camera.coords.dot(&middle.left());
    let oncoming = match input.options.traffic_side {
        TrafficSide::Right => left_m > options.roadside_m,
        TrafficSide::Left => left_m < -options.roadside_m,
    };
    let front = if oncoming { folded + PI } else { folded };
    ((0..states.len()).map(|k| local(input.start + k, front)).collect(), variance)
}

/// Headings of a standing vehicle from those of a network's views, relative to each frame's camera. A network errs by an angle that is common to all
/// views of a vehicle, while most vehicles are parked along the road or across it: where such a direction is more probable than an oblique one, the
/// heading is the mean of both by their variances. With their common variance \[rad²\]. The road is that where the camera comes nearest; in a bend it is less certain.
pub(super) fn parked_headings(
    input: &TrackInput<'_>,
    states: &[KinematicState],
    by_views: &[f64],
) -> (Vec<f64>, f64) {
    let options = &input.options.advanced.heading;
    let seen = input.external_headings.views.iter().filter_map(|v| Some((input.grounds.get(v.frame)?, v)));
    let forward = |(ground, view): (&GroundFrame, &ExternalView)| {
        let heading = by_views.get(view.frame.checked_sub(input.start)?)?;
        Some(ground.world_from_camera.transform_vector(&ground.direction_of(*heading)))
    };
    let mean: Vector3<f64> = seen.clone().filter_map(forward).sum();
    let middle = seen.clone().nth(seen.count() / 2).map(|(ground, _)| ground);
    let (Some(middle), Some(state)) = (middle, states.first()) else { return (by_views.to_vec(), 0.0) };
    let away = |g: &GroundFrame| (g.world_from_camera.translation() - state.position).norm_squared();
    let nearest = input.grounds.iter().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(middle);
    let angle_to = |ground: &GroundFrame, direction: &Vector3<f64>| {
        ground.heading_of(&ground.world_from_camera.inverse().transform_vector(direction))
    };
    let bend = angle_to(nearest, &middle.world_from_camera.transform_vector(&middle.ahead()));
    let (angle, variance) = options.parked_angle(angle_to(nearest, &mean), 0.5 * bend);
    let parked = nearest.world_from_camera.transform_vector(&nearest.direction_of(angle));
    let frames = input.grounds.iter().skip(input.start).take(by_views.len());
    (frames.map(|ground| angle_to(ground, &parked)).collect(), variance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::external::ExternalTrack;
    use crate::options::VehicleOptions;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, track_of};
    use nalgebra::Matrix6;

    /// On a circle of 12 m the middle of a car moves 6° to the left of its heading, its rear axle along it.
    #[test]
    fn a_car_in_a_bend_points_where_its_rear_axle_goes() {
        let (grounds, options) = (level_grounds(30), VehicleOptions::default());
        let car = car_ahead(1, 0.0, 20.0);
        let (track, external) = (track_of(&car, [true; 4]), ExternalTrack::default());
        let input = TrackInput {
            camera: &CAMERA,
            grounds: &grounds,
            track: &track,
            external: &external,
            external_headings: &external,
            prior: options.advanced.size.prior(car.class),
            start: 0,
            options: &options,
        };
        let (radius_m, speed_mps) = (12.0, 6.0);
        let rear_m = options.advanced.heading.rear_axle_share * car.size.length_m;
        let turned = |k: usize| speed_mps / radius_m * grounds[k].time_s;
        // To the left of straight ahead; y points down.
        let at = |angle: f64| Vector3::new(-angle.sin(), 0.0, angle.cos());
        let middle = |k: usize| {
            let velocity =
                at(turned(k)) * speed_mps + at(turned(k) + FRAC_PI_2) * (rear_m * speed_mps / radius_m);
            let covariance = Matrix6::identity() * 1e-9;
            KinematicState { position: Vector3::z() * 20.0, velocity, covariance }
        };
        let states: Vec<KinematicState> = (0..30).map(middle).collect();
        let headings = travel_headings(&input, &states, car.size.length_m, &[0.0; 30]);
        // A turn that may be none leaves the direction of travel as it is.
        let vague = |s: &KinematicState| KinematicState { covariance: Matrix6::identity() * 1e6, ..*s };
        let vague: Vec<KinematicState> = states.iter().map(vague).collect();
        let travelled = travel_headings(&input, &vague, car.size.length_m, &[0.0; 30]);
        assert!(headings.iter().zip(&travelled).all(|(h, t)| (t - h - 0.105).abs() < 0.01), "{travelled:?}");
        for (k, heading) in headings.into_iter().enumerate() {
            assert!((heading - turned(k)).abs() < 1e-6, "{k}: {heading} {}", turned(k));
            let travel = states[k].velocity.normalize();
            assert!(travel.dot(&at(turned(k))).acos() > 0.09);
        }
    }

    #[test]
    fn the_nearest_known_entry_is_found() {
        let values = [None, Some(()), None, None, None, Some(()), None];
        let found: Vec<usize> = nearest_known(&values).into_iter().flatten().collect();
        assert_eq!(found, [1, 1, 1, 1, 5, 5, 5]);
        assert!(nearest_known::<()>(&[None, None]).iter().all(Option::is_none));
    }
}
