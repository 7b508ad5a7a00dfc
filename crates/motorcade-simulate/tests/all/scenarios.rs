//! The built-in scenarios are physically possible.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade_simulate::{
    Body, Drive, MeasureOptions, RenderOptions, Scenario, TrailerKind, scenarios, simulate, simulate_again,
};
use nalgebra::{Point2, Point3};

fn driven(name: &str, frames: usize, seed: u64) -> Drive {
    simulate(&Scenario::by_name(name).unwrap(), frames, seed, &RenderOptions::default()).unwrap()
}

#[test]
fn there_are_many_with_different_names() {
    let mut names: Vec<String> = scenarios().into_iter().map(|s| s.name).collect();
    assert!(names.len() >= 12);
    names.sort();
    names.dedup();
    assert_eq!(names.len(), scenarios().len());
    assert!(Scenario::by_name("no such drive").is_none());
}

/// Discs along the body; two bodies touch where discs do.
fn discs(
    centre: Point2<f64>,
    forward: nalgebra::Vector2<f64>,
    length: f64,
    width: f64,
) -> Vec<(Point2<f64>, f64)> {
    let radius = 0.5 * width;
    let n = (length / width).ceil() as i32 + 1;
    (0..n)
        .map(|i| (centre + forward * ((f64::from(i) / f64::from(n - 1) - 0.5) * (length - width)), radius))
        .collect()
}

#[test]
fn nobody_drives_through_anybody() {
    for scenario in scenarios() {
        let drive = simulate(&scenario, 120, 5, &RenderOptions::default()).unwrap();
        for frame in (0..drive.len()).step_by(3) {
            let camera = drive.site_from_camera[frame];
            let nose = camera.transform_vector(&nalgebra::Vector3::z()).xy().normalize();
            let eye = Point3::from(camera.translation()).xy();
            let mut bodies = vec![discs(eye - nose * 0.3, nose, 4.2, 1.75)];
            for vehicle in &drive.vehicles {
                let pose = vehicle.poses[frame].unwrap();
                let forward = pose.transform_vector(&nalgebra::Vector3::x()).xy().normalize();
                let centre = Point3::from(pose.translation()).xy();
                bodies.push(discs(centre, forward, vehicle.size.length_m, vehicle.size.width_m));
            }
            for (i, a) in bodies.iter().enumerate() {
                for (j, b) in bodies.iter().enumerate().skip(i + 1) {
                    // A trailer rests on the vehicle that tows it.
                    let towed_by = match drive.vehicles[j - 1].body {
                        Body::Trailer { towed_by, .. } => Some(towed_by as usize + 1),
                        _ => None,
                    };
                    if towed_by == Some(i) {
                        continue;
                    }
                    let touch = a.iter().any(|(p, r)| b.iter().any(|(q, s)| (p - q).norm() < r + s));
                    assert!(
                        !touch,
                        "{}: frame {frame}: body {i} (0 is the camera) and body {j}",
                        scenario.name
                    );
                }
            }
        }
    }
}

/// Position of the axle that does not steer, from the centre, as a share of the length: roughly that of all cars and lorries.
fn fixed_axle(body: Body) -> f64 {
    match body {
        Body::Trailer { kind: TrailerKind::Semi, .. } => -0.184,
        Body::Trailer { kind: TrailerKind::Caravan, .. } => -0.141,
        Body::Usual | Body::Tractor => -0.29,
    }
}

#[test]
fn vehicles_move_along_their_heading_with_accelerations_of_traffic() {
    let options = RenderOptions::default();
    for scenario in scenarios() {
        let drive = simulate(&scenario, 150, 5, &options).unwrap();
        // Cars of `turning` are too fast for their corners; its pictures are kept.
        let most_aside = if scenario.name == "turning" { 7.5 } else { 4.5 };
        for vehicle in &drive.vehicles {
            let axle = Point3::new(fixed_axle(vehicle.body) * vehicle.size.length_m, 0.0, 0.0);
            for frame in 1..drive.len() {
                let [before, after] = [frame - 1, frame].map(|k| vehicle.poses[k].unwrap());
                let moved = after.transform_point(&axle) - before.transform_point(&axle);
                let [nose, left] = [nalgebra::Vector3::x(), nalgebra::Vector3::y()]
                    .map(|axis| 0.5 * (before.transform_vector(&axis) + after.transform_vector(&axis)));
                let at = format!("{}: vehicle {}, frame {frame}", scenario.name, vehicle.id);
                assert!(
                    moved.dot(&left).abs() < 0.03 * moved.norm() + 1e-6,
                    "{at}: {} m aside",
                    moved.dot(&left)
                );
                assert!(moved.dot(&nose) >= -1e-9, "{at}: backwards");
                let speed = vehicle.speeds_m_s[frame];
                let faster = (speed - vehicle.speeds_m_s[frame - 1]) * options.fps;
                let [a, b] = [before, after].map(|p| p.transform_vector(&nalgebra::Vector3::x()));
                let aside = speed * a.xy().perp(&b.xy()) * options.fps;
                assert!(faster.abs() < 4.0 && aside.abs() < most_aside, "{at}: {faster}, {aside} m/s²");
            }
        }
    }
}

#[test]
fn trailers_hang_on_their_hitches_and_turn_later() {
    let drive = driven("trailers", 90, 1);
    let mut found = 0;
    for trailer in &drive.vehicles {
        let Body::Trailer { kind, towed_by } = trailer.body else { continue };
        found += 1;
        let towing = &drive.vehicles[towed_by as usize];
        // Rear axle of tractors at 0.29 of the length behind the centre, the kingpin 0.4 m ahead of it and 1.6 m behind the front.
        let (hitch, front) = match kind {
            TrailerKind::Semi => (0.4 - 0.29 * towing.size.length_m, 0.5 * trailer.size.length_m - 1.6),
            TrailerKind::Caravan => (-0.5 * towing.size.length_m, 0.5 * trailer.size.length_m),
        };
        let mut widest = 0.0_f64;
        for frame in 0..drive.len() {
            let (ahead, behind) = (towing.poses[frame].unwrap(), trailer.poses[frame].unwrap());
            let apart = ahead.transform_point(&Point3::new(hitch, 0.0, 0.0))
                - behind.transform_point(&Point3::new(front, 0.0, 0.0));
            assert!(apart.xy().norm() < 0.02, "{kind:?}, frame {frame}: {apart}");
            let [a, b] = [ahead, behind].map(|p| p.transform_vector(&nalgebra::Vector3::x()).xy());
            widest = widest.max(b.perp(&a).abs().asin().to_degrees());
        }
        assert!((4.0..35.0).contains(&widest), "{kind:?}: {widest}°");
    }
    assert_eq!(found, 4);
}

#[test]
fn labels_of_trailers_are_misc() {
    let all = driven("trailers", 10, 1).measure(&MeasureOptions::default()).unwrap();
    let class = |track: i64| all.labels.iter().find(|l| l.track == track).map(|l| l.class.as_str());
    assert_eq!((class(0), class(1)), (Some("Truck"), Some("Misc")));
    assert!(
        all.detections.iter().any(|d| d.class == "Truck") && all.detections.iter().all(|d| d.class != "Misc")
    );
}

#[test]
fn traffic_of_a_roundabout_turns_by_a_third_to_more_than_half_a_circle() {
    let drive = driven("roundabout-exits", 230, 1);
    // Largest heading relative to the smallest one before it.
    let turned = |vehicle: usize| {
        let headings: Vec<_> = drive.vehicles[vehicle]
            .poses
            .iter()
            .map(|p| p.unwrap().transform_vector(&nalgebra::Vector3::x()).xy())
            .collect();
        let (mut heading, mut least, mut most) = (0.0_f64, 0.0_f64, 0.0_f64);
        for pair in headings.windows(2) {
            heading += pair[0].perp(&pair[1]).atan2(pair[0].dot(&pair[1])).to_degrees();
            least = least.min(heading);
            most = most.max(heading - least);
        }
        most
    };
    for (vehicle, expected) in [(0, 109.0), (1, 109.0), (2, 199.0), (3, 199.0)] {
        let found = turned(vehicle);
        assert!((found - expected).abs() < 15.0, "vehicle {vehicle} turned by {found}° of {expected}°");
    }
}

#[test]
fn the_crest_is_one_and_the_dip_is_lower() {
    let drive = driven("crest", 110, 1);
    let z: Vec<f64> = drive.site_from_camera.iter().map(|p| p.translation().z).collect();
    let (highest, lowest) =
        (z.iter().copied().fold(f64::MIN, f64::max), z.iter().copied().fold(f64::MAX, f64::min));
    assert!(
        (1.0..1.8).contains(&(highest - z[0])) && (0.4..1.5).contains(&(z[0] - lowest)),
        "{highest} {lowest}"
    );
}

#[test]
fn on_the_motorway_some_are_twenty_metres_a_second_faster_and_lorries_slower() {
    let drive = driven("motorway", 60, 1);
    let way = |poses: &[Option<motorcade_geometry::Pose<_, motorcade_geometry::Vehicle>>]| {
        let [a, b]: [motorcade_geometry::Pose<motorcade_simulate::Site, _>; 2] =
            [poses[0].unwrap(), poses[59].unwrap()];
        (b.translation() - a.translation()).x / 5.9
    };
    let own = drive.length_m() / 5.9;
    let speeds: Vec<f64> = drive.vehicles.iter().map(|v| way(&v.poses) - own).collect();
    assert!((own - 30.0).abs() < 0.3 && speeds.iter().any(|v| (v - 20.0).abs() < 0.5));
    assert!(
        speeds.iter().filter(|v| (-9.0..-4.0).contains(*v)).count() >= 3 && speeds.iter().any(|v| *v < -55.0)
    );
}

#[test]
fn camera_and_vehicles_stand_on_the_road() {
    for scenario in scenarios() {
        let drive = simulate(&scenario, 60, 9, &RenderOptions::default()).unwrap();
        for frame in (0..drive.len()).step_by(7) {
            let camera = drive.site_from_camera[frame].translation();
            let (road_z, _) = drive.road.surface(&Point2::new(camera.x, camera.y));
            let height = camera.z - road_z;
            assert!((height - scenario.plan.rig.height_m).abs() < 0.05, "{}: {height}", scenario.name);
            for vehicle in &drive.vehicles {
                let position = vehicle.poses[frame].unwrap().translation();
                let (road_z, _) = drive.road.surface(&Point2::new(position.x, position.y));
                assert!((position.z - road_z).abs() < 1e-6, "{}: vehicle {}", scenario.name, vehicle.id);
            }
        }
    }
}

#[test]
fn seeds_decide() {
    let (a, b, c) = (driven("dense", 20, 1), driven("dense", 20, 1), driven("dense", 20, 2));
    assert_eq!(a.site_from_camera, b.site_from_camera);
    assert_eq!(a.vehicles.len(), b.vehicles.len());
    assert!(a.vehicles.iter().zip(&b.vehicles).all(|(x, y)| x.poses == y.poses && x.size == y.size));
    assert_ne!(a.site_from_camera, c.site_from_camera);
}

#[test]
fn the_demo_is_what_it_says() {
    let drive = driven("demo", 120, 1);
    let moved = |v: &motorcade_simulate::SimulatedVehicle| {
        (v.poses[119].unwrap().translation() - v.poses[0].unwrap().translation()).norm() > 5.0
    };
    assert_eq!(drive.vehicles.iter().filter(|v| moved(v)).count(), 3);
    assert_eq!(drive.vehicles.iter().filter(|v| !moved(v)).count(), 2);
    assert!((95.0..125.0).contains(&drive.length_m()), "{}", drive.length_m());
}

#[test]
fn a_standing_car_neither_moves_nor_rocks() {
    let drive = driven("standing-start", 80, 3);
    assert_eq!(drive.site_from_camera[0], drive.site_from_camera[35]);
    assert!(
        (drive.site_from_camera[79].translation() - drive.site_from_camera[0].translation()).norm() > 5.0
    );
}

#[test]
fn the_crowd_is_one() {
    let drive = driven("crowd", 3, 1);
    let in_sight = (0..drive.vehicles.len()).filter(|i| {
        let centre = drive.camera_from_vehicle(*i, 0).unwrap().translation();
        centre.z > 1.0
            && drive.camera().project(&Point3::from(centre)).is_some_and(|p| drive.camera().contains(&p, 0.0))
    });
    let count = in_sight.count();
    assert!(count >= 60, "{count} vehicles in the frame");
}

#[test]
fn rounds_come_to_the_same_place_and_the_tunnel_is_dark() {
    for (name, seconds, round_m, speed) in [("block", 110, 340.0, 7.0), ("figure-eight", 110, 296.0, 6.0)] {
        let drive = driven(name, 10 * seconds, 1);
        let at = |frame: usize| drive.site_from_camera[frame];
        let later = (10.0 * round_m / speed) as usize;
        for frame in (0..200).step_by(20) {
            let near = (later.saturating_sub(60)..later + 60).map(|k| {
                let apart = at(frame).inverse() * at(frame + k);
                (apart.translation().norm(), apart.rotation().angle())
            });
            let (way, turn) = near.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            assert!(way < 0.6 && turn < 0.05, "{name}: frame {frame}: {way} m, {turn} rad");
        }
    }
    let drive = driven("town-10min", 2600, 1);
    let start = drive.site_from_camera[0];
    let near = (1000..2600).map(|k| start.inverse() * drive.site_from_camera[k]);
    let again = near.map(|apart| apart.translation().norm() + apart.rotation().angle());
    assert!(again.fold(f64::INFINITY, f64::min) < 0.9);
    // KITTI odometry 00 is 3,724 m long, in as many frames.
    let drive = driven("suburb", 4541, 1);
    let steps = drive.site_from_camera.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm());
    let way_m: f64 = steps.sum();
    assert!((3500.0..3650.0).contains(&way_m), "{way_m} m");
    let drive = driven("tunnel", 700, 1);
    assert!(!drive.is_dark(549) && drive.is_dark(550) && drive.is_dark(649) && !drive.is_dark(650));
    assert!((0..700).all(|frame| !driven("block", 1, 1).is_dark(frame)));
}

#[test]
fn another_visit_sees_the_same_streets_with_other_traffic() {
    let scenario = Scenario::by_name("block").unwrap();
    let options = RenderOptions::default().with_width(64);
    let (first, same) = (driven("block", 40, 1), simulate_again(&scenario, 40, (1, 1), &options).unwrap());
    let again = simulate_again(&scenario, 40, (1, 2), &options).unwrap();
    assert_eq!((again.seed, again.road.round_m()), (first.seed, first.road.round_m()));
    assert!(first.first_visit_from_camera().is_none() && same.first_visit.is_some());
    // In the world of the first visit it starts a few metres on, in the same direction.
    let start = again.first_visit_from_camera().unwrap()[0];
    assert!((0.0..12.5).contains(&start.translation().z) && start.translation().x.abs() < 1.0, "{start:?}");
    let parked = |drive: &Drive| {
        drive.vehicles.iter().filter_map(|v| v.poses[0].map(|p| p.translation())).collect::<Vec<_>>()
    };
    assert_ne!(parked(&first), parked(&again));
}

#[test]
fn the_way_back_is_the_other_lane_in_the_opposite_direction() {
    let drive = driven("same-street-opposite", 400, 1);
    let heading = |frame: usize| drive.site_from_camera[frame].transform_vector(&nalgebra::Vector3::z());
    assert!(heading(10).x > 0.99 && heading(399).x < -0.99);
    let back = drive.site_from_camera[399].translation();
    assert!((back.y - 1.75).abs() < 0.5 && back.x < 60.0, "{back}");
}
