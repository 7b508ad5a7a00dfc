//! Vehicles in one place.
//!
//! Two tracks on a vehicle (one of its two boxes, the boxes before and after it was hidden, those parted from a track that slipped) become two
//! cuboids within each other. Two vehicles are not in one place; two that are seen side by side are two, wherever they were placed.

use motorcade_geometry::{BoundingBox, Pose, Vehicle, World};

use crate::ground::GroundFrame;
use crate::met_again::{best, join};
use crate::options::{AdvancedVehicleOptions, MetAgainOptions};
use crate::trajectory::{Source, VehicleState, VehicleTrajectory};

/// Makes one vehicle of two of which one has its centre within the footprint of the other and that are not seen side by side: of standing ones
/// where both are known best, if the camera drove less than `most_gap_m` between them (beyond, only places seen again tell that it is the same place), of
/// moving ones in most frames they share. Of the identities that of the vehicle with the larger sum of scores stays.
/// `grounds` are those of all frames.
pub fn join_in_one_place(
    vehicles: Vec<VehicleTrajectory>,
    grounds: &[GroundFrame],
    options: &AdvancedVehicleOptions,
) -> Vec<VehicleTrajectory> {
    let evidence = |v: &VehicleTrajectory| v.states.iter().map(|s| s.score).sum::<f64>();
    let mut by_evidence = vehicles;
    by_evidence.sort_by(|a, b| evidence(b).total_cmp(&evidence(a)).then(a.id.cmp(&b.id)));
    let mut out: Vec<VehicleTrajectory> = Vec::with_capacity(by_evidence.len());
    let (ways, most_gap_m) = (ways_m(grounds), options.met_again.most_gap_m);
    for vehicle in by_evidence {
        let stands = |v: &VehicleTrajectory| v.p_moving < options.kinematic_state.moving_from;
        let in_place_of = |v: &&mut VehicleTrajectory| {
            let overlap = match (stands(v), stands(&vehicle)) {
                (true, true) => {
                    overlap(v, &vehicle, options.met_again.least_cosine)
                        && way_between_m(v, &vehicle, &ways) <= most_gap_m
                }
                (false, false) => move_as_one(v, &vehicle, grounds, &options.met_again),
                _ => false,
            };
            overlap && !side_by_side(&vehicle, v, options)
        };
        match out.iter_mut().find(in_place_of) {
            Some(stronger) => {
                join(stronger, vehicle);
                one_state_a_frame(&mut stronger.states);
            }
            None => out.push(vehicle),
        }
    }
    out.sort_by_key(|v| v.id);
    out
}

/// Way of the camera up to each frame \[m\].
fn ways_m(grounds: &[GroundFrame]) -> Vec<f64> {
    let place = |g: &GroundFrame| g.world_from_camera.translation();
    let mut ways = vec![0.0; grounds.len().min(1)];
    for pair in grounds.windows(2) {
        ways.push(ways.last().unwrap_or(&0.0) + (place(&pair[1]) - place(&pair[0])).norm());
    }
    ways
}

/// Way of the camera between the nearest frames in which the one and the other were seen \[m\]; infinite without any.
fn way_between_m(a: &VehicleTrajectory, b: &VehicleTrajectory, ways: &[f64]) -> f64 {
    let between =
        |frame: usize, other: Option<&VehicleState>| Some((ways.get(frame)? - ways.get(other?.frame)?).abs());
    let nearest = |s: &VehicleState| {
        let after = a.states.partition_point(|o| o.frame < s.frame);
        let before = after.checked_sub(1).and_then(|k| a.states.get(k));
        [between(s.frame, before), between(s.frame, a.states.get(after))]
    };
    b.states.iter().flat_map(nearest).flatten().fold(f64::INFINITY, f64::min)
}

/// True when the centre of one vehicle lies within the footprint of the other one, and their axes are parallel as `least_cosine` has it.
fn overlap(a: &VehicleTrajectory, b: &VehicleTrajectory, least_cosine: f64) -> bool {
    let (Some(of_a), Some(of_b)) = (best(a), best(b)) else { return false };
    let (of_a, of_b) = (&of_a.world_from_vehicle, &of_b.world_from_vehicle);
    let parallel = (of_a.inverse() * *of_b).rotation_matrix()[(0, 0)].abs() >= least_cosine;
    parallel && (covers(a, of_a, of_b) || covers(b, of_b, of_a))
}

/// True when in most frames that two vehicles share, and for some time, the centre of one lies within the footprint of the other one, with headings that
/// differ as `least_cosine` has it at most.
fn move_as_one(
    a: &VehicleTrajectory,
    b: &VehicleTrajectory,
    grounds: &[GroundFrame],
    options: &MetAgainOptions,
) -> bool {
    let cosine = |p: &VehicleState, q: &VehicleState| {
        (p.world_from_vehicle.inverse() * q.world_from_vehicle).rotation_matrix()[(0, 0)]
    };
    let of_b = |p: &VehicleState| {
        let k = b.states.binary_search_by_key(&p.frame, |q| q.frame).ok()?;
        Some(&b.states[k])
    };
    let shared: Vec<(&VehicleState, &VehicleState)> =
        a.states.iter().filter_map(|p| Some((p, of_b(p)?))).collect();
    let as_one = |(p, q): &&(&VehicleState, &VehicleState)| {
        let (of_a, of_b) = (&p.world_from_vehicle, &q.world_from_vehicle);
        cosine(p, q) >= options.least_cosine && (covers(a, of_a, of_b) || covers(b, of_b, of_a))
    };
    let together: Vec<usize> = shared.iter().filter(as_one).map(|(p, _)| p.frame).collect();
    let time_s = |frame: Option<&usize>| frame.and_then(|k| grounds.get(*k)).map_or(0.0, |g| g.time_s);
    let lasts_s = time_s(together.last()) - time_s(together.first());
    // The fronts of the two, where they are known best, have to agree too: joined states keep one front.
    let one_front = best(a).zip(best(b)).is_some_and(|(p, q)| cosine(p, q) > 0.0);
    one_front && lasts_s >= options.least_together_s && 2 * together.len() > shared.len()
}

fn covers(vehicle: &VehicleTrajectory, at: &Pose<World, Vehicle>, other: &Pose<World, Vehicle>) -> bool {
    let apart = (at.inverse() * *other).translation();
    apart.x.abs() < 0.5 * vehicle.size.length_m && apart.y.abs() < 0.5 * vehicle.size.width_m
}

/// True when boxes of `weak` are beside those of `strong`, neither a part of the other, in more frames than a few.
fn side_by_side(
    weak: &VehicleTrajectory,
    strong: &VehicleTrajectory,
    options: &AdvancedVehicleOptions,
) -> bool {
    let hypothesis = &options.hypothesis;
    let seen = |v: &VehicleTrajectory, frame: usize| {
        let state = v.states.binary_search_by_key(&frame, |s| s.frame).ok().map(|k| &v.states[k]);
        state.filter(|s| s.source != Source::Predicted).and_then(|s| s.bbox)
    };
    let apart = |a: &BoundingBox, b: &BoundingBox| {
        a.intersection(b) <= hypothesis.double_inside * a.area().min(b.area())
    };
    let boxes = || weak.states.iter().filter_map(|s| Some((s.frame, seen(weak, s.frame)?)));
    let beside =
        boxes().filter(|(frame, own)| seen(strong, *frame).is_some_and(|other| apart(own, &other))).count();
    beside as f64 > hypothesis.most_foreign_share * boxes().count() as f64
}

/// Of two states of a frame the measured one stays, and of two measured ones that with the larger score.
fn one_state_a_frame(states: &mut Vec<VehicleState>) {
    let key = |s: &VehicleState| (s.frame, s.source == Source::Predicted);
    states.sort_by(|a, b| key(a).cmp(&key(b)).then(b.score.total_cmp(&a.score)));
    states.dedup_by_key(|s| s.frame);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::{level_grounds, standing_car};
    use nalgebra::Vector6;

    /// A car along x at this place, measured with this score; predicted without.
    fn vehicle(id: usize, frames: std::ops::Range<usize>, at: [f64; 2], score: f64) -> VehicleTrajectory {
        standing_car(id, frames, at).with_scores(|_| score)
    }

    #[test]
    fn one_vehicle_stands_in_a_place() {
        let all = vec![
            vehicle(1, 10..20, [0.0, 0.5], 0.5),
            vehicle(2, 5..30, [0.8, 0.1], 0.7),
            vehicle(3, 5..30, [5.2, 0.0], 0.7),
            vehicle(4, 5..30, [0.0, 2.1], 0.7),
            vehicle(5, 40..45, [0.4, 0.0], 0.7),
        ];
        let found = join_in_one_place(all, &level_grounds(60), &AdvancedVehicleOptions::default());
        let spans: Vec<(usize, usize)> = found.iter().map(|v| (v.id, v.states.len())).collect();
        assert_eq!(spans, [(2, 30), (3, 25), (4, 25)]);
        assert!(found[0].p_moving < 0.01);
        assert!(found[0].states.windows(2).all(|w| w[0].frame < w[1].frame));
    }

    #[test]
    fn places_far_apart_along_the_way_are_not_told_by_odometry() {
        let driving = |step_m: f64| {
            let mut grounds = level_grounds(60);
            for (k, ground) in grounds.iter_mut().enumerate() {
                ground.world_from_camera =
                    Pose::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, step_m * k as f64));
            }
            grounds
        };
        // 21 frames between them: 21 m and 63 m.
        let all = || vec![vehicle(1, 5..20, [0.0, 0.0], 0.7), vehicle(2, 40..50, [0.3, 0.0], 0.7)];
        let options = AdvancedVehicleOptions::default();
        assert_eq!(join_in_one_place(all(), &driving(1.0), &options).len(), 1);
        assert_eq!(join_in_one_place(all(), &driving(3.0), &options).len(), 2);
    }

    #[test]
    fn measured_states_stay() {
        let mut strong = vehicle(1, 0..30, [0.0, 0.0], 0.7);
        for state in &mut strong.states[10..20] {
            (state.score, state.source) = (0.0, Source::Predicted);
        }
        let weak = vehicle(2, 8..16, [0.2, 0.0], 0.5);
        let found =
            join_in_one_place(vec![weak, strong], &level_grounds(60), &AdvancedVehicleOptions::default());
        let score = |frame: usize| found[0].states[frame].score;
        assert_eq!((found.len(), found[0].id), (1, 1));
        assert_eq!([score(9), score(12), score(18)], [0.7, 0.5, 0.0]);
    }

    /// A track that ends on a vehicle and the one that began on it; one that drives into its way, and one that meets it once.
    #[test]
    fn moving_vehicles_that_go_as_one_are_one() {
        let drives = |id: usize, frames: std::ops::Range<usize>, ahead_m: f64, speed: f64| {
            let mut moves = vehicle(id, frames.clone(), [0.0, 0.0], 0.7);
            moves.p_moving = 1.0;
            for state in &mut moves.states {
                let along = ahead_m + speed * (state.frame - frames.start) as f64;
                state.world_from_vehicle = Pose::exp(&Vector6::new(0.0, 0.0, 0.0, along, 0.0, 0.0));
            }
            moves
        };
        let joined = |all: Vec<VehicleTrajectory>| -> Vec<(usize, usize)> {
            let found = join_in_one_place(all, &level_grounds(60), &AdvancedVehicleOptions::default());
            found.iter().map(|v| (v.id, v.states.len())).collect()
        };
        assert_eq!(joined(vec![drives(1, 0..12, 0.0, 1.5), drives(2, 10..40, 15.4, 1.5)]), [(2, 40)]);
        assert_eq!(joined(vec![drives(1, 0..12, 0.0, 1.5), drives(2, 10..40, 15.4, 5.0)]).len(), 2);
        assert_eq!(joined(vec![drives(1, 0..12, 0.0, 1.5), drives(2, 11..40, 16.5, 1.5)]).len(), 2);
        let mut turned = drives(2, 10..40, 15.4, 1.5);
        for state in &mut turned.states {
            let half: Pose<Vehicle, Vehicle> = Pose::exp(&Vector6::new(0.0, 0.0, 3.1, 0.0, 0.0, 0.0));
            state.world_from_vehicle = state.world_from_vehicle * half;
        }
        assert_eq!(joined(vec![drives(1, 0..12, 0.0, 1.5), turned]).len(), 2);
    }

    #[test]
    fn what_moves_is_not_joined_with_what_stands() {
        let mut moves = vehicle(2, 0..10, [0.0, 0.0], 0.7);
        moves.p_moving = 0.5;
        let (options, stands) = (AdvancedVehicleOptions::default(), vehicle(1, 0..10, [0.0, 0.0], 0.7));
        assert_eq!(join_in_one_place(vec![stands, moves], &level_grounds(60), &options).len(), 2);
        assert!(join_in_one_place(Vec::new(), &level_grounds(60), &options).is_empty());
    }

    /// Neighbours of a row, one of them placed wrongly; a cab and its lorry.
    #[test]
    fn vehicles_seen_side_by_side_are_two() {
        let with_box = |id: usize, x_px: f64, width_px: f64| {
            let mut seen = vehicle(id, 0..20, [0.1 * id as f64, 0.0], 0.7);
            let bbox = BoundingBox::new([x_px, 100.0, x_px + width_px, 150.0]);
            seen.states.iter_mut().for_each(|s| s.bbox = Some(bbox));
            seen
        };
        let joined = |other: VehicleTrajectory| {
            join_in_one_place(
                vec![with_box(1, 200.0, 60.0), other],
                &level_grounds(60),
                &AdvancedVehicleOptions::default(),
            )
            .len()
        };
        assert_eq!(joined(with_box(2, 240.0, 60.0)), 2);
        assert_eq!(joined(with_box(2, 220.0, 30.0)), 1);
    }
}
