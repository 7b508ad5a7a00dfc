//! Identities of simulated vehicles: one each, through jumps, gaps and duplicate boxes.

#![allow(clippy::unwrap_used, reason = "a test")]

mod street;

use std::collections::BTreeSet;

use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M, Drive};
use motorcade_vehicles::{
    Dimensions, ExternalTrack, ExternalView, GroundFrame, Source, Track, TrackerOptions, VehicleOptions,
    estimate_track, image_box, size_prior, track_both_ways, track_vehicles, upright_pose,
};
use nalgebra::{Matrix3, Vector3};
use street::{car, car_below, detected, grounds, grounds_of, outline};

fn linked(grounds: &[GroundFrame], detections: &[Vec<Detection>]) -> Vec<Track> {
    track_vehicles(
        &CAMERA,
        grounds,
        detections,
        &TrackerOptions::default(),
        &VehicleOptions::default(),
        &|| false,
    )
}

fn link(frames: usize, seen: impl Fn(usize) -> Vec<Detection>) -> Vec<Track> {
    link_below(CAMERA_HEIGHT_M, frames, seen)
}

fn link_below(height_m: f64, frames: usize, seen: impl Fn(usize) -> Vec<Detection>) -> Vec<Track> {
    let detections: Vec<Vec<Detection>> = (0..frames).map(seen).collect();
    linked(&grounds(frames, height_m), &detections)
}

#[test]
fn each_vehicle_has_one_identity() {
    // Ahead at the camera's speed, oncoming at 15 m/s, parked.
    let tracks = link(60, |k| {
        let t = 0.1 * k as f64;
        let all = [car(20.0, 0.0), car(70.0 - 25.0 * t, 3.5), car(55.0 - 10.0 * t, -4.0)];
        all.into_iter().flatten().collect()
    });
    assert_eq!(tracks.len(), 3);
    assert_eq!(tracks[0].boxes.len(), 60);
}

#[test]
fn boxes_that_are_there_several_times_are_one_vehicle() {
    let tracks = link(20, |_| vec![car(20.0, 0.0).unwrap(); 500]);
    assert_eq!((tracks.len(), tracks[0].boxes.len()), (1, 20));
}

#[test]
fn a_box_that_jumps_does_not_carry_the_track_away() {
    // For one frame the box covers a third of the car, as behind a lorry, and places it three times as far away.
    let tracks = link(40, |k| {
        let mut seen = car(21.0, 0.5).unwrap();
        if k == 20 {
            let (x, y) = seen.bbox.centre();
            let (w, h) = (0.35 * seen.bbox.width(), 0.35 * seen.bbox.height());
            seen.bbox = BoundingBox { x1: x - w, y1: y - h, x2: x + w, y2: y + h };
        }
        vec![seen]
    });
    assert_eq!(tracks.len(), 1);
    assert_eq!(tracks[0].boxes.len(), 40);
}

/// Weak boxes that show no vehicle cover three edges of a clear one's box.
#[test]
fn clutter_does_not_keep_a_clear_box_from_starting_a_track() {
    let tracks = link(20, |k| {
        let clear = Detection { score: 0.75, ..car(30.0 - 0.5 * k as f64, -8.0).unwrap() };
        let BoundingBox { x1, y1, x2, y2 } = clear.bbox;
        let (w, h) = (x2 - x1, y2 - y1);
        let weak = |left: f64, right: f64| {
            let bbox =
                BoundingBox { x1: x1 + left * w, y1: y1 - 0.1 * h, x2: x1 + right * w, y2: y2 + 0.2 * h };
            Detection { score: 0.25, bbox, ..clear.clone() }
        };
        vec![weak(-0.9, 0.4), weak(0.6, 1.9), weak(-0.3, 1.4), clear]
    });
    assert_eq!(tracks.len(), 1);
    assert_eq!(tracks[0].boxes.len(), 20);
    assert!(tracks[0].boxes.iter().all(|b| b.observed.edges == [true; 4]));
}

#[test]
fn a_vehicle_is_reidentified_after_a_gap() {
    // Oncoming, occluded for 1.2 s.
    let tracks = link(50, |k| {
        let hidden = (15..27).contains(&k);
        car(90.0 - 1.6 * k as f64, 3.5).into_iter().filter(|_| !hidden).collect()
    });
    assert_eq!(tracks.len(), 1);
    assert_eq!(tracks[0].boxes.last().unwrap().frame, 49);
}

/// Clutter that is taken for a car here and there, long after a clear box of one, does not keep that car's track for the next car.
#[test]
fn weak_boxes_here_and_there_keep_no_track_alive() {
    let of = |every: usize| {
        let seen = |k: usize| {
            let score = if (5..60).contains(&k) { 0.2 } else { 0.7 };
            let found = !(5..60).contains(&k) || k.is_multiple_of(every);
            car(30.0, 0.0).filter(|_| found).map(|c| Detection { score, ..c }).into_iter().collect()
        };
        link(70, seen).iter().map(|t| t.boxes.len()).collect::<Vec<usize>>()
    };
    // Within 2 s of the last clear box it may come again; then a weak one is awaited for 0.3 s.
    assert_eq!(of(8), [5 + 3, 10]);
    assert_eq!(of(3), [5 + 18 + 10]);
}

/// A row of cars parked across the road beside it, the further ones half occluded by the nearer: assumed along the road they
/// would be three times as near, and appear to move.
#[test]
fn cars_parked_across_the_road_are_static() {
    let frames = 20;
    let places: Vec<f64> = (0..4).map(|k| 26.0 + 2.6 * f64::from(k)).collect();
    let grounds = grounds(frames, CAMERA_HEIGHT_M);
    let seen = |ahead_m: f64| {
        let ground = &grounds[0];
        let pose = upright_pose(&ground.point(ahead_m, -8.0, 0.0), &ground.left(), &ground.up);
        let bbox = outline(&pose)?;
        (bbox.width() > 5.0).then(|| detected(bbox))
    };
    // The nearer cars leave the left part of the further ones visible.
    let left_of = |further: &Detection, nearer: &Detection| {
        let bbox = BoundingBox { x2: further.bbox.x2.min(nearer.bbox.x1 + 4.0), ..further.bbox };
        Detection { bbox, ..further.clone() }
    };
    let frame = |k: usize| -> Vec<Detection> {
        let whole: Vec<Detection> = places.iter().filter_map(|p| seen(p - k as f64)).collect();
        let nearer = std::iter::once(None).chain(whole.iter().map(Some));
        let all = whole.iter().zip(nearer).map(|(d, n)| n.map_or_else(|| d.clone(), |n| left_of(d, n)));
        all.filter(|d| d.bbox.width() > 20.0).collect()
    };
    let detections: Vec<Vec<Detection>> = (0..frames).map(frame).collect();
    let tracks = linked(&grounds, &detections);
    assert_eq!(tracks.len(), places.len());
    let mut answered: Vec<usize> = Vec::new();
    for track in &tracks {
        let none = ExternalTrack::default();
        let found = estimate_track(&CAMERA, &grounds, track, &none, &VehicleOptions::default()).unwrap();
        assert!(found.p_moving < 0.5, "{} {}", track.id, found.p_moving);
        let there = found.states[0].world_from_vehicle.translation();
        let miss = |k: &usize| (there - Vector3::new(8.0, 1.65, places[*k])).norm();
        let nearest = (0..places.len()).min_by(|a, b| miss(a).total_cmp(&miss(b))).unwrap();
        assert!(miss(&nearest) < 1.2, "{} {there}: {} m", track.id, miss(&nearest));
        assert!(!answered.contains(&nearest), "two at {nearest}");
        answered.push(nearest);
        let nose = found.states[0].world_from_vehicle.transform_vector(&Vector3::x());
        // Of the further ones too little is visible for the orientation.
        assert!(nearest > 0 || nose.x.abs() > 0.95, "{nose}");
    }
}

/// A car passed on the left is followed on weak boxes that slide onto the car ahead: those never take that car's confident box,
/// though they fit it better now and then.
#[test]
fn weak_boxes_beside_a_vehicle_do_not_take_its_identity() {
    let tracks = link(60, |k| {
        let ahead = car(20.0 + 0.03 * (k % 3) as f64, 0.0).unwrap();
        let slide = 0.1 * (k.saturating_sub(10) as f64).min(35.0);
        let mut beside = car(20.0, 3.5 - slide).unwrap();
        beside.score = if k < 10 { 0.8 } else { 0.3 };
        vec![ahead, beside]
    });
    let first = tracks.iter().max_by_key(|t| t.boxes.len()).unwrap();
    assert_eq!(first.boxes.len(), 60, "{:?}", tracks.iter().map(|t| t.boxes.len()).collect::<Vec<_>>());
    assert!(first.boxes.iter().all(|b| b.score > 0.5), "the car ahead has a weak box");
}

/// Cars parked one behind the other, a tenth larger than a car is assumed to be, so that they are placed too near and seem to
/// creep along; each is missed in turn while the next one is seen.
#[test]
fn a_row_of_parked_cars_keeps_its_identities() {
    let grounds = grounds(70, CAMERA_HEIGHT_M);
    let places = [36.0, 44.0, 52.0, 60.0];
    let mean = size_prior(VehicleClass::Car).mean;
    let size = Dimensions::from_vector(&(mean.to_vector() * 1.1));
    let seen = |k: usize, car: usize| {
        let ground = &grounds[0];
        let place = ground.point(places[car] - k as f64, 7.0, 0.0);
        let pose = upright_pose(&place, &ground.ahead(), &ground.up);
        let (class, convention) = (VehicleClass::Car, BoxConvention::VisibleExtent);
        let whole = image_box(&CAMERA, &pose, class, convention, &size)?;
        let bbox = whole.clipped(CAMERA.width, CAMERA.height);
        // Not detected in 4 of 24 frames; gone once mostly out of the picture.
        let missed = (k + 6 * car) % 24 < 4;
        let there = bbox.width() > 0.6 * whole.width() && bbox.width() > 5.0 && !missed;
        there.then(|| Detection { external_id: Some(car as i64), ..detected(bbox) })
    };
    let frame = |k: usize| -> Vec<Detection> { (0..places.len()).filter_map(|car| seen(k, car)).collect() };
    let detections: Vec<Vec<Detection>> = (0..grounds.len()).map(frame).collect();
    let tracks = linked(&grounds, &detections);
    for track in &tracks {
        let cars: BTreeSet<usize> = track
            .boxes
            .iter()
            .map(|b| {
                let same = |d: &&Detection| d.bbox == b.observed.bbox;
                detections[b.frame].iter().find(same).unwrap().external_id.unwrap() as usize
            })
            .collect();
        assert_eq!(cars.len(), 1, "track {} has boxes of the cars {cars:?}", track.id);
    }
    assert_eq!(tracks.len(), places.len(), "{:?}", tracks.iter().map(|t| t.boxes.len()).collect::<Vec<_>>());
}

/// A parked car is hidden by one that crosses before it, a third of whose box is on its own.
#[test]
fn a_box_that_overlaps_a_parked_car_little_is_another_cars() {
    let seen = |k: usize, overlapping: f64| {
        let parked = car(50.0 - k as f64, 5.0).unwrap();
        if k < 6 {
            return vec![parked];
        }
        // As high, and moved to the side until this share of the union is common.
        let shift = parked.bbox.width() * (1.0 - overlapping) / (1.0 + overlapping);
        let BoundingBox { x1, y1, x2, y2 } = parked.bbox;
        vec![Detection { bbox: BoundingBox { x1: x1 + shift, y1, x2: x2 + shift, y2 }, ..parked }]
    };
    let lengths = |overlapping: f64| -> Vec<usize> {
        link(12, |k| seen(k, overlapping)).iter().map(|track| track.boxes.len()).collect()
    };
    assert_eq!(lengths(0.3), [6, 6]);
    assert_eq!(lengths(0.7), [12]);
}

/// Boxes of a car that drives straight ahead in the world, occluded in some frames.
fn boxes_of(
    grounds: &[GroundFrame],
    start: Vector3<f64>,
    velocity: Vector3<f64>,
    hidden: std::ops::Range<usize>,
) -> Vec<Vec<Detection>> {
    let one = |(k, ground): (usize, &GroundFrame)| {
        let camera_from_world = ground.world_from_camera.inverse();
        let place = camera_from_world.transform_point(&(start + velocity * ground.time_s).into());
        let nose = camera_from_world.transform_vector(&velocity).normalize();
        let pose = upright_pose(&place, &nose, &ground.up);
        let bbox = outline(&pose)?;
        // Edges jitter by a pixel from frame to frame.
        let jitter = |n: usize| ((k * 7 + n * 3) % 5) as f64 * 0.5 - 1.0;
        let bbox = BoundingBox {
            x1: bbox.x1 + jitter(0),
            y1: bbox.y1 + jitter(1),
            x2: bbox.x2 + jitter(2),
            y2: bbox.y2 + jitter(3),
        };
        let seen = bbox.width() > 5.0 && bbox.height() > 5.0 && !hidden.contains(&k);
        seen.then(|| detected(bbox))
    };
    grounds.iter().enumerate().map(|ground| one(ground).into_iter().collect()).collect()
}

#[test]
fn a_vehicle_is_reidentified_after_two_seconds() {
    // Occluded for 20 frames of 0.1 s: oncoming, ahead at the camera's speed, ahead and faster, parked.
    let straight = grounds(55, CAMERA_HEIGHT_M);
    let turned = grounds_of(&Drive::turning(55, 10.0, 10.0, 0.3, 1.0..4.0), CAMERA_HEIGHT_M);
    /// Name, ground, start and velocity.
    type Car<'a> = (&'a str, &'a [GroundFrame], Vector3<f64>, Vector3<f64>);
    let cars: [Car<'_>; 5] = [
        ("oncoming", &straight, Vector3::new(-3.5, 1.65, 120.0), Vector3::new(0.0, 0.0, -12.0)),
        ("ahead", &straight, Vector3::new(0.0, 1.65, 20.0), Vector3::new(0.0, 0.0, 10.0)),
        ("faster", &straight, Vector3::new(-3.5, 1.65, 15.0), Vector3::new(0.0, 0.0, 14.0)),
        ("parked", &straight, Vector3::new(4.0, 1.65, 85.0), Vector3::new(0.0, 0.0, 1e-3)),
        // The camera turns left by 0.6 rad during the gap; the car drives on to the left.
        ("turn", &turned, Vector3::new(-3.0, 1.65, 22.0), Vector3::new(-5.0, 0.0, 9.0)),
    ];
    for (name, grounds, start, velocity) in cars {
        let detections = boxes_of(grounds, start, velocity, 15..35);
        let seen = |range: std::ops::Range<usize>| range.filter(|k| !detections[*k].is_empty()).count();
        assert!(seen(0..15) >= 12 && seen(35..55) >= 10, "{name} is out of the picture: no test");
        let tracks = linked(grounds, &detections);
        let spans: Vec<_> =
            tracks.iter().map(|t| (t.boxes[0].frame, t.boxes.last().unwrap().frame)).collect();
        assert_eq!(tracks.len(), 1, "{name}: {spans:?}");
    }
}

#[test]
fn another_vehicle_after_a_gap_is_another_vehicle() {
    // One drives away and is occluded; two seconds later another is parked far from its predicted position.
    let straight = grounds(55, CAMERA_HEIGHT_M);
    let away = boxes_of(&straight, Vector3::new(0.0, 1.65, 15.0), Vector3::new(0.0, 0.0, 18.0), 15..55);
    let parked = boxes_of(&straight, Vector3::new(4.0, 1.65, 85.0), Vector3::new(0.0, 0.0, 1e-3), 0..35);
    let both: Vec<Vec<Detection>> = away.into_iter().zip(parked).map(|(a, b)| [a, b].concat()).collect();
    let tracks = linked(&straight, &both);
    assert_eq!(tracks.len(), 2);
}

#[test]
fn a_duplicate_box_starts_no_track() {
    let tracks = link(20, |_| {
        let one = car(15.0, 0.0).unwrap();
        let (b, class) = (one.bbox, VehicleClass::Van);
        let looser = BoundingBox { x1: b.x1 - 4.0, y1: b.y1 - 6.0, x2: b.x2 + 5.0, y2: b.y2 + 2.0 };
        vec![one, Detection { class, score: 0.6, ..detected(looser) }]
    });
    assert_eq!(tracks.len(), 1);
}

#[test]
fn a_car_that_reappears_from_behind_another_keeps_its_identity() {
    const HIDDEN: std::ops::Range<usize> = 20..31;
    // Parked at the right; a van occludes it for a second, then its right part reappears, a fifth of it first.
    let parked = |k: usize| car(60.0 - k as f64, -4.0).unwrap().bbox;
    let seen = |k: usize| -> Vec<Detection> {
        let whole = parked(k);
        let share = if k < HIDDEN.start { 1.0 } else { 0.2 + 0.1 * k.saturating_sub(HIDDEN.end) as f64 };
        let x1 = whole.x2 - share.min(1.0) * whole.width();
        let part = (!HIDDEN.contains(&k)).then(|| detected(BoundingBox { x1, ..whole }));
        let van = BoundingBox { x1: x1 - 140.0, y1: whole.y1 - 40.0, x2: x1, y2: whole.y2 + 40.0 };
        let hides = (HIDDEN.end..HIDDEN.end + 8).contains(&k);
        part.into_iter().chain(hides.then(|| detected(van))).collect()
    };
    let tracks = link(45, seen);
    let of_parked =
        |t: &&Track| t.boxes.iter().any(|b| (b.observed.bbox.x2 - parked(b.frame).x2).abs() < 1e-9);
    let found: Vec<usize> = tracks.iter().filter(of_parked).map(|t| t.boxes.len()).collect();
    assert_eq!(found, [45 - HIDDEN.len()], "boxes of the tracks of one car");
}

#[test]
fn sixty_vehicles_in_a_frame_and_one_frame_of_a_vehicle() {
    // A car park of six rows seen from a bridge; a car in one frame only is not reported.
    const BRIDGE_M: f64 = 8.0;
    const ROWS_M: [f64; 6] = [46.0, 60.0, 79.0, 104.0, 137.0, 180.0];
    let tracks = link_below(BRIDGE_M, 12, |k| {
        let at = |i: usize| (ROWS_M[i / 10] - k as f64, 15.75 - 3.5 * (i % 10) as f64);
        let row = |i: usize| car_below(BRIDGE_M, at(i).0, at(i).1);
        let mut all: Vec<Detection> = (0..60).filter_map(row).collect();
        if k == 6 {
            all.extend(car_below(BRIDGE_M, 120.0, 0.0));
        }
        all
    });
    assert_eq!(tracks.len(), 60);
    assert!(tracks.iter().all(|t| t.boxes.len() == 12));
}

#[test]
fn reversed_external_headings_are_turned() {
    let grounds = grounds(30, CAMERA_HEIGHT_M);
    let views: Vec<ExternalView> = (0..30)
        .map(|frame| {
            let ground = &grounds[frame];
            // Parked across the street; every third view, the first among them, is reversed.
            let sign = if frame % 3 == 0 { -1.0 } else { 1.0 };
            ExternalView {
                frame,
                position_in_camera: ground.point(45.0 - frame as f64, -4.0, 0.0),
                forward_in_camera: ground.direction_of(1.2) * sign,
                covariance: Matrix3::identity() * 0.25,
                heading_sigma_rad: 0.15,
                size_dependence: None,
                scale_sigma: 0.0,
                source: Source::External,
            }
        })
        .collect();
    let given = ExternalTrack { views, size: None };
    let track = Track::new(1, VehicleClass::Car, Vec::new());
    let vehicle = estimate_track(&CAMERA, &grounds, &track, &given, &VehicleOptions::default()).unwrap();
    assert!(vehicle.p_moving < 0.5 && vehicle.states.len() == 30);
    for state in &vehicle.states {
        let ground = &grounds[state.frame];
        let nose = ground.world_from_camera.inverse() * state.world_from_vehicle;
        let off = nose.transform_vector(&Vector3::x()).angle(&ground.direction_of(1.2));
        assert!(off < 0.05, "frame {}: {off} rad", state.frame);
        assert_eq!(state.source, Source::External);
    }
}

/// A van, 2.1 m high, that the detector calls a car, oncoming: its size alone would place it a quarter too near, its lower edge
/// says where it stands.
#[test]
fn a_van_called_a_car_stands_where_it_is() {
    let (frames, class) = (20, VehicleClass::Van);
    let grounds = grounds(frames, CAMERA_HEIGHT_M);
    let size = size_prior(class).mean;
    let ahead_m = |k: usize| 45.0 - 1.7 * k as f64;
    let one = |k: usize| {
        let ground = &grounds[0];
        let pose = upright_pose(&ground.point(ahead_m(k), 1.0, 0.0), &-ground.ahead(), &ground.up);
        detected(image_box(&CAMERA, &pose, class, BoxConvention::VisibleExtent, &size).unwrap())
    };
    let detections: Vec<Vec<Detection>> = (0..frames).map(|k| vec![one(k)]).collect();
    let tracks = linked(&grounds, &detections);
    assert_eq!(tracks.len(), 1);
    assert_eq!(tracks[0].class, VehicleClass::Car);
    let none = ExternalTrack::default();
    let found = estimate_track(&CAMERA, &grounds, &tracks[0], &none, &VehicleOptions::default()).unwrap();
    assert_eq!(found.class, class);
    for state in &found.states {
        let in_camera = grounds[state.frame].world_from_camera.inverse() * state.world_from_vehicle;
        let error = in_camera.translation().z / ahead_m(state.frame) - 1.0;
        assert!(error.abs() < 0.06, "frame {}: {error}", state.frame);
    }
}

#[test]
fn both_ways_give_one_track_where_they_agree() {
    let both = |seen: &dyn Fn(usize) -> Vec<Detection>| {
        let detections: Vec<Vec<Detection>> = (0..60).map(seen).collect();
        let (tracker, vehicles) = (TrackerOptions::default(), VehicleOptions::default());
        track_both_ways(&CAMERA, &grounds(60, CAMERA_HEIGHT_M), &detections, &tracker, &vehicles, &|| false)
    };
    let agreed = both(&|k| {
        let t = 0.1 * k as f64;
        [car(20.0, 0.0), car(70.0 - 25.0 * t, 3.5), car(55.0 - 10.0 * t, -4.0)]
            .into_iter()
            .flatten()
            .collect()
    });
    assert_eq!(agreed.len(), 3);
    // Boxes too weak to start a track, before the clear ones: backwards they go on with the track of these.
    let weak = both(&|k| {
        let score = if k < 20 { 0.2 } else { 0.8 };
        car(30.0, 0.0).map(|c| Detection { score, ..c }).into_iter().collect()
    });
    let spans: Vec<(usize, usize, usize)> =
        weak.iter().map(|t| (t.id, t.boxes[0].frame, t.boxes.len())).collect();
    assert_eq!(spans, [(1, 20, 40), (2, 0, 60)]);
    assert!(weak[1].boxes.windows(2).all(|b| b[0].frame < b[1].frame));
}
