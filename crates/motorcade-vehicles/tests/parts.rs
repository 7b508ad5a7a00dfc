//! Tracks whose boxes are those of several vehicles, or of none.

#![allow(clippy::unwrap_used, reason = "a test")]

#[allow(dead_code, reason = "not every test uses all of it")]
mod street;

use std::f64::consts::FRAC_PI_2;

use motorcade_perception::{BoundingBox, Detection, VehicleClass};
use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M};
use motorcade_vehicles::{
    ExternalTrack, ExternalView, ObservedBox, Source, Track, TrackBox, VehicleOptions, estimate_consistently,
    upright_pose,
};
use nalgebra::{Matrix3, Vector3};
use street::{car, detected, grounds, outline};

/// A tracker that went from one parked car to the next: no trajectory explains the boxes of both, each part has its own.
#[test]
fn a_track_over_two_parked_cars_is_parted() {
    let frames = 24;
    let grounds = grounds(frames, CAMERA_HEIGHT_M);
    let ahead_m = |k: usize, from_m: f64| from_m - grounds[k].world_from_camera.translation().z;
    let detections: Vec<Vec<Detection>> = (0..frames)
        .map(|k| {
            let [near, far] = [car(ahead_m(k, 40.0), 4.0), car(ahead_m(k, 50.0), 9.0)];
            vec![if k < 18 { near } else { far }.unwrap()]
        })
        .collect();
    let options = VehicleOptions::default();
    let boxes = |range: std::ops::Range<usize>| {
        let observed = |d: &Detection| ObservedBox::new(d, &CAMERA, &[], &options.advanced.box_fit);
        range
            .map(|frame| TrackBox { frame, observed: observed(&detections[frame][0]), score: 0.8 })
            .collect::<Vec<_>>()
    };
    let track = Track::new(7, VehicleClass::Car, boxes(0..frames));
    let none = |_: &Track| ExternalTrack::default();
    let estimate =
        |next: Option<&mut usize>| estimate_consistently(&CAMERA, &grounds, &track, &none, &options, next);
    let mut next = 20;
    let mut found = estimate(Some(&mut next));
    found.sort_by_key(|v| v.id);
    let places: Vec<f64> = found.iter().map(|v| v.states[0].world_from_vehicle.translation().z).collect();
    assert_eq!(found.len(), 2, "{places:?}");
    assert!(found[0].id == 7 && found[1].id >= 20 && next > 20);
    let nearest = |at: f64| places.iter().map(|p| (p - at).abs()).fold(f64::MAX, f64::min);
    assert!(nearest(40.0) < 2.0 && nearest(50.0) < 2.5, "{places:?}");
    // A window of the last seconds keeps its identities.
    assert_eq!(estimate(None).iter().map(|v| v.id).collect::<Vec<_>>(), [7]);
    // One car alone stays as it is.
    let track = Track::new(7, VehicleClass::Car, boxes(0..12));
    assert_eq!(estimate_consistently(&CAMERA, &grounds, &track, &none, &options, Some(&mut next)).len(), 1);
}

/// A row of cars parked beside each other: far away a tracker took the boxes of the next one.
#[test]
fn near_boxes_show_which_car_of_a_row_it_is() {
    let frames = 36;
    let grounds = grounds(frames, CAMERA_HEIGHT_M);
    let ahead_m = |k: usize, from_m: f64| from_m - grounds[k].world_from_camera.translation().z;
    let (own_m, next_m) = (58.0, 63.5);
    let options = VehicleOptions::default();
    let boxes = (0..frames).map(|frame| {
        let at_m = if frame < 16 { next_m } else { own_m };
        let detection = car(ahead_m(frame, at_m), 16.0).unwrap();
        let observed = ObservedBox::new(&detection, &CAMERA, &[], &options.advanced.box_fit);
        TrackBox { frame, observed, score: 0.8 }
    });
    let track = Track::new(7, VehicleClass::Car, boxes.collect());
    let none = |_: &Track| ExternalTrack::default();
    let mut next = 20;
    let mut found = estimate_consistently(&CAMERA, &grounds, &track, &none, &options, Some(&mut next));
    found.sort_by_key(|v| v.id);
    let places: Vec<f64> = found.iter().map(|v| v.states[0].world_from_vehicle.translation().z).collect();
    assert_eq!(found.len(), 2, "{places:?}");
    assert!((places[0] - own_m).abs() < 1.0 && (places[1] - next_m).abs() < 2.5, "{places:?}");
}

/// A tracker that slipped to the next parked car beside the road: boxes of a car that drives slowly, but for the road that is not below them.
#[test]
fn a_slip_to_the_neighbour_beside_the_road_is_no_slow_drive() {
    const LEFT_M: f64 = 8.0;
    let frames = 40;
    let grounds = grounds(frames, CAMERA_HEIGHT_M);
    let options = VehicleOptions::default();
    let ahead_m = |k: usize, from_m: f64| from_m - grounds[k].world_from_camera.translation().z;
    let estimate = |at_m: &dyn Fn(usize) -> f64, road_below: Option<f64>| {
        let boxes = (0..frames).map(|frame| {
            let detection = Detection { road_below, ..car(ahead_m(frame, at_m(frame)), LEFT_M).unwrap() };
            let observed = ObservedBox::new(&detection, &CAMERA, &[], &options.advanced.box_fit);
            TrackBox { frame, observed, score: 0.8 }
        });
        let track = Track::new(7, VehicleClass::Car, boxes.collect());
        let view = |b: &TrackBox| ExternalView {
            frame: b.frame,
            position_in_camera: grounds[b.frame].point(ahead_m(b.frame, at_m(b.frame)), LEFT_M, 0.0),
            forward_in_camera: Vector3::z() * (at_m(1) + 1e-3 - at_m(0)).signum(),
            covariance: Matrix3::identity() * 0.04,
            heading_sigma_rad: 0.05,
            size_dependence: None,
            scale_sigma: 0.0,
            source: Source::Keypoints,
        };
        let views =
            |track: &Track| ExternalTrack { views: track.boxes.iter().map(view).collect(), size: None };
        let found = estimate_consistently(&CAMERA, &grounds, &track, &views, &options, Some(&mut 20));
        found.iter().map(|v| v.p_moving).collect::<Vec<_>>()
    };
    for by_m in [6.0, 7.0, 8.0] {
        let slips = |k: usize| if k < 20 { 72.0 } else { 72.0 + by_m };
        let (driving, standing) = (estimate(&slips, None), estimate(&slips, Some(0.1)));
        assert!(driving.len() == 1 && driving[0] > 0.5, "{by_m} m: {driving:?}");
        assert!(!standing.is_empty() && standing.iter().all(|p| *p < 0.2), "{by_m} m: {standing:?}");
    }
    // Cars that drive on a road, and cars of the oncoming traffic behind a barrier.
    let drives = |mps: f64| move |k: usize| 72.0 + 0.1 * mps * k as f64;
    for (mps, road_below) in [(4.0, Some(0.9)), (4.0, None), (-4.0, Some(0.0))] {
        let driving = estimate(&drives(mps), road_below);
        assert!(driving.len() == 1 && driving[0] > 0.5, "{mps} m/s: {driving:?}");
    }
}

/// A car that crosses the camera's way, slightly forwards, and something hides the road below it.
#[test]
fn what_crosses_the_way_moves_without_road_below() {
    let frames = 24;
    let grounds = grounds(frames, CAMERA_HEIGHT_M);
    let options = VehicleOptions::default();
    let boxes = (0..frames).map(|frame| {
        let ground = &grounds[frame];
        let ahead_m = 60.0 + 0.05 * frame as f64 - ground.world_from_camera.translation().z;
        let place = ground.point(ahead_m, 14.0 - 0.75 * frame as f64, 0.0);
        let pose = upright_pose(&place, &ground.direction_of(-FRAC_PI_2), &ground.up);
        let detection = Detection { road_below: Some(0.1), ..detected(outline(&pose).unwrap()) };
        let observed = ObservedBox::new(&detection, &CAMERA, &[], &options.advanced.box_fit);
        TrackBox { frame, observed, score: 0.8 }
    });
    let track = Track::new(7, VehicleClass::Car, boxes.collect());
    let none = |_: &Track| ExternalTrack::default();
    let found = estimate_consistently(&CAMERA, &grounds, &track, &none, &options, Some(&mut 20));
    assert_eq!(found.iter().map(|v| (v.id, v.states.len())).collect::<Vec<_>>(), [(7, frames)]);
    assert!(found[0].p_moving > 0.5);
    let speed = found[0].states[frames / 2].speed_mps;
    assert!((speed - 7.5).abs() < 0.6, "{speed}");
}

/// Boxes that jump over the picture are no vehicle, however fast it would have to drive.
#[test]
fn what_would_drive_faster_than_any_vehicle_is_none() {
    let grounds = grounds(5, CAMERA_HEIGHT_M);
    let options = VehicleOptions::default();
    let boxes = (0..5).map(|frame| {
        let detection = car(40.0 - 8.5 * frame as f64, 3.0).unwrap();
        let observed = ObservedBox::new(&detection, &CAMERA, &[], &options.advanced.box_fit);
        TrackBox { frame, observed, score: 0.8 }
    });
    let track = Track::new(1, VehicleClass::Car, boxes.collect());
    let none = |_: &Track| ExternalTrack::default();
    assert!(estimate_consistently(&CAMERA, &grounds, &track, &none, &options, None).is_empty());
}

/// Houses 8 m high, 300 m away and 65 m aside: called cars, they would drive along with the camera, a metre above the road.
#[test]
fn a_building_in_the_background_is_no_vehicle() {
    let frames = 40;
    let grounds = grounds(frames, CAMERA_HEIGHT_M);
    let mut options = VehicleOptions::default();
    let found = |detection: &dyn Fn(f64) -> Detection, options: &VehicleOptions| {
        let boxes = (0..frames).map(|frame| {
            let driven_m = grounds[frame].world_from_camera.translation().z;
            let observed = ObservedBox::new(&detection(driven_m), &CAMERA, &[], &options.advanced.box_fit);
            TrackBox { frame, observed, score: 0.8 }
        });
        let track = Track::new(1, VehicleClass::Car, boxes.collect());
        let none = |_: &Track| ExternalTrack::default();
        estimate_consistently(&CAMERA, &grounds, &track, &none, options, Some(&mut 20))
    };
    let houses = |driven_m: f64| {
        let px = |m: f64| CAMERA.fx * m / (300.0 - driven_m);
        let (x, below) = (CAMERA.cx - px(65.0), CAMERA.cy + px(3.0));
        detected(BoundingBox::new([x - px(10.0), below - px(8.0), x + px(10.0), below]))
    };
    assert!(found(&houses, &options).is_empty());
    // A car that drives ahead at the camera's speed has the boxes of something infinitely far away, but for the road below it.
    let ahead = found(&|_| car(30.0, 3.5).unwrap(), &options);
    assert!(ahead.len() == 1 && ahead[0].p_moving > 0.9);
    // Without the test of the road they are a vehicle.
    options.advanced.hypothesis.hanging_sigmas = f64::MAX;
    assert_eq!(found(&houses, &options).len(), 1);
}
