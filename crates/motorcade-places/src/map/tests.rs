//! Maps as bytes.

use motorcade_geometry::{PinholeCamera, Pose};
use nalgebra::{Matrix6, Vector6};

use super::{MapError, PlaceMap};
use crate::features::{Descriptor, Feature};
use crate::hidden::HiddenParts;
use crate::keyframe::{Landmark, PlacedKeyframe};

fn map() -> PlaceMap {
    let camera = PinholeCamera { fx: 720.0, fy: 721.0, cx: 600.0, cy: 170.0, width: 1242, height: 375 };
    let keyframe = |k: usize| {
        let feature = |i: usize| Feature {
            descriptor: Descriptor([i as u64, k as u64, !0, 7]),
            pixel: [i as f32 * 3.5, 20.0],
            level: (i % 4) as u8,
            turn: i as u8,
        };
        let landmark = |i: usize| Landmark {
            feature: i as u32,
            point_in_camera: [i as f32, -1.0, 9.0 + k as f32],
            depth_sigma: 0.05,
        };
        let world_from_camera = Pose::exp(&Vector6::new(0.1, 0.2, 0.0, k as f64, 0.0, 3.0));
        let (features, landmarks) = ((0..5).map(feature).collect(), (0..5).map(landmark).collect());
        PlacedKeyframe {
            frame: 10 * k,
            segment: k / 2,
            world_from_camera,
            covariance: Matrix6::from_fn(|r, c| {
                if r == c { 0.01 * (k + r + 1) as f64 } else { 1e-4 * (r + c) as f64 }
            }),
            way_m: 3.0 * k as f64,
            features,
            landmarks,
            hidden: HiddenParts::default(),
        }
    };
    PlaceMap { camera, height_m: 1.65, keyframes: (0..4).map(keyframe).collect() }
}

#[test]
fn a_map_reads_back() {
    let map = map();
    let bytes = map.to_bytes();
    let again = PlaceMap::from_bytes(&bytes).unwrap();
    assert_eq!(again.to_bytes(), bytes);
    assert_eq!(again.summary(), map.summary());
    assert_eq!((again.summary().landmarks, again.summary().segments), (20, 2));
    assert!(again.keyframes[3].covariance == map.keyframes[3].covariance);
    assert!(again.keyframes[3].world_from_camera == map.keyframes[3].world_from_camera);
}

#[test]
fn what_is_no_map_is_refused() {
    let bytes = map().to_bytes();
    assert!(matches!(PlaceMap::from_bytes(b"ply\n"), Err(MapError::NoMap(_))));
    let mut newer = bytes.clone();
    newer[8] = 9;
    assert_eq!(PlaceMap::from_bytes(&newer).unwrap_err(), MapError::Version { found: 9, known: 2 });
    for at in [40, 200, bytes.len() - 3] {
        let mut changed = bytes.clone();
        changed[at] ^= 0x10;
        assert!(matches!(PlaceMap::from_bytes(&changed), Err(MapError::Damaged(_))), "byte {at}");
    }
    for length in [12, 60, 100, bytes.len() - 1] {
        assert!(
            matches!(PlaceMap::from_bytes(&bytes[..length]), Err(MapError::Damaged(_))),
            "{length} bytes"
        );
    }
}

#[test]
fn covariances_that_are_none_are_refused() {
    let mut map = map();
    map.keyframes[1].covariance[(4, 4)] = -0.1;
    assert!(matches!(PlaceMap::from_bytes(&map.to_bytes()), Err(MapError::Damaged(_))));
}

#[test]
fn points_of_a_map_are_in_the_world() {
    let ply = map().to_ply();
    assert!(ply.contains("element vertex 24\n"));
    assert_eq!(ply.lines().skip_while(|l| *l != "end_header").skip(1).count(), 24);
}
