//! The files of a run with the camera and one vehicle.

use motorcade::{RecordedFrame, RecordedRun, RecordedState, RecordedVehicle};
use motorcade_geometry::Pose;
use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M};
use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3};

use super::*;
use crate::{Anchor, Scenario, ScenarioOptions};

/// Ten frames straight ahead at 10 m/s; from the fourth to the eighth a car 20 m ahead of the camera, which drives as fast.
fn run() -> RecordedRun {
    let frames = (0..10).map(|k| RecordedFrame {
        number: k as u64,
        timestamp_ns: 5_000_000_000 + i64::from(k) * 100_000_000,
        status: "tracked".into(),
        speed_mps: 10.0,
        speed_sigma_mps: Some(0.1),
        road_normal: -Vector3::y(),
        world_from_camera: Pose::from_parts(UnitQuaternion::identity(), Vector3::new(0.0, 0.0, f64::from(k))),
        covariance: Matrix6::identity() * 1e-4,
    });
    // Forward is z of the world, left is -x, up is -y.
    let axes = Matrix3::from_columns(&[Vector3::z(), -Vector3::x(), -Vector3::y()]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let states = (3..8).map(|k| RecordedState {
        row: k,
        world_from_vehicle: Pose::from_parts(turn, Vector3::new(0.0, 1.5, 20.0 + k as f64)),
        speed_mps: 10.0,
        sigma_m: [0.3, 0.1, 0.05],
        predicted: false,
        score: 0.8,
    });
    let vehicle = RecordedVehicle {
        id: 7,
        class: "Van".into(),
        size_m: [5.0, 2.0, 2.0],
        p_moving: 0.99,
        states: states.collect(),
    };
    RecordedRun { frames: frames.collect(), vehicles: vec![vehicle] }
}

/// North at the equator: 1 m is 1/110,574 degrees of latitude there.
fn placed(run: &RecordedRun, clock: Option<f64>) -> Placed<'_> {
    let anchor = Anchor { clock_offset_s: clock, ..("0,0,0,100".parse().unwrap()) };
    Placed::new(run, anchor).unwrap()
}

#[test]
fn maps_have_the_camera_and_the_vehicle_at_their_places() {
    let run = run();
    let collection: serde_json::Value = serde_json::from_str(&geojson(&placed(&run, Some(1e9)))).unwrap();
    let features = collection["features"].as_array().unwrap();
    assert_eq!(features.len(), 2);
    let last = &features[0]["geometry"]["coordinates"][9];
    let north_m = last[1].as_f64().unwrap() * 110_574.0;
    assert!((north_m - 9.0).abs() < 0.02 && last[0].as_f64().unwrap().abs() < 1e-7, "{last}");
    let van = &features[1];
    assert_eq!(
        (van["properties"]["class"].as_str(), van["properties"]["id"].as_u64()),
        (Some("Van"), Some(7))
    );
    let first = &van["geometry"]["coordinates"][0];
    // On the road, 1.5 m below the camera.
    assert!((first[1].as_f64().unwrap() * 110_574.0 - 23.0).abs() < 0.02);
    assert!((first[2].as_f64().unwrap() - 98.5).abs() < 0.011);
    assert_eq!(van["properties"]["times"][0], "2001-09-09T01:46:45.300Z");
    let gpx = gpx(&placed(&run, Some(1e9)));
    assert_eq!((gpx.matches("<trk>").count(), gpx.matches("<trkpt").count()), (2, 15));
    assert!(gpx.contains("<time>2001-09-09T01:46:45.000Z</time>") && gpx.contains("<name>Van 7</name>"));
    let kml = kml(&placed(&run, None));
    assert_eq!(kml.matches("<Placemark>").count(), 2);
    // Unknown times are not written.
    assert!(!super::gpx(&placed(&run, None)).contains("<time>"));
}

#[test]
fn a_track_written_is_read_again() {
    let run = run();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.gpx");
    let text = gpx(&placed(&run, Some(1e9)));
    // The camera's alone.
    let camera = text.split("</trk>").next().unwrap().to_owned() + "</trk></gpx>";
    std::fs::write(&path, camera).unwrap();
    let track = motorcade_dataset::GpsTrack::read(&path).unwrap();
    assert_eq!(track.points.len(), 10);
    assert!((track.points[9].time_s - 1_000_000_005.9).abs() < 1e-6);
}

#[test]
fn oxts_has_thirty_columns_in_their_units() {
    let run = run();
    let text = oxts(&placed(&run, None));
    let rows: Vec<Vec<f64>> =
        text.lines().map(|line| line.split(' ').map(|v| v.parse().unwrap()).collect()).collect();
    assert!(rows.len() == 10 && rows.iter().all(|row| row.len() == 30));
    let row = &rows[4];
    assert!((row[0] * 110_574.0 - 4.0).abs() < 0.02 && (row[2] - 100.0).abs() < 1e-3);
    // Yaw from east: north is a quarter turn. Velocities north, east, forward, left, up.
    assert!((row[5] - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
    for (value, expected) in row[6..11].iter().zip([10.0, 0.0, 10.0, 0.0, 0.0]) {
        assert!((value - expected).abs() < 1e-4, "{row:?}");
    }
}

#[test]
fn a_scenario_has_rear_axles_on_the_road_and_vehicles_for_the_time_they_are_seen() {
    let run = run();
    let text = xosc(&Scenario::new(&placed(&run, Some(1e9)), 1.5, &ScenarioOptions::default()));
    assert!(text.contains(r#"date="2001-09-09T01:46:45.000Z""#));
    assert!(text.contains(r#"<Vehicle name="Van 7" vehicleCategory="van">"#));
    // 23 m ahead, its rear axle 0.3 of 5 m behind its middle; on the road, which is the origin's height; heading north.
    let position = r#"<WorldPosition x="0.000" y="21.500" z="0.000" h="1.57080" p="0.00000" r="0.00000"/>"#;
    let after = text.split("<AddEntityAction>").nth(1).unwrap();
    assert!(after.lines().nth(2).unwrap().contains(position), "{after}");
    assert_eq!(text.matches("<DeleteEntityAction/>").count(), 1);
    assert_eq!(text.matches(r#"<Vertex time=""#).count(), 15);
    // The camera is at the origin, its car's rear axle 1.62 m behind it.
    assert!(text.contains(r#"<WorldPosition x="0.000" y="-1.620" z="0.000""#));
}

#[test]
fn the_way_of_a_map_of_places_is_on_the_earth() {
    // Two metres ahead a keyframe; the last one belongs to another map.
    let keyframe = |k: usize| motorcade_places::PlacedKeyframe {
        frame: 5 * k,
        segment: k / 3,
        world_from_camera: Pose::from_parts(
            UnitQuaternion::identity(),
            Vector3::new(0.0, 0.0, 2.0 * k as f64),
        ),
        covariance: Matrix6::identity() * 1e-4,
        way_m: 2.0 * k as f64,
        features: Vec::new(),
        landmarks: Vec::new(),
        hidden: motorcade_places::HiddenParts::default(),
    };
    let map = motorcade::PlaceMap {
        camera: CAMERA,
        height_m: CAMERA_HEIGHT_M,
        keyframes: (0..4).map(keyframe).collect(),
    };
    let east: Anchor = "49,8,90".parse().unwrap();
    let text: serde_json::Value = serde_json::from_str(&places_geojson(&map, &east)).unwrap();
    let features = text["features"].as_array().unwrap();
    assert_eq!(features.len(), 2);
    assert_eq!(features[0]["properties"]["rows"], serde_json::json!([0, 5, 10]));
    let line = features[0]["geometry"]["coordinates"].as_array().unwrap();
    let degrees = |k: usize, axis: usize| line[k][axis].as_f64().unwrap();
    // A degree of longitude is 73 km there.
    assert!(((degrees(2, 0) - 8.0) * 73_172.0 - 4.0).abs() < 0.05 && (degrees(2, 1) - 49.0).abs() < 1e-6);
    assert_eq!(features[1]["geometry"]["type"], "Point");
}
