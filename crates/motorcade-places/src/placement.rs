//! Keyframes with poses and landmarks.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};

use crate::keyframe::{PlaceKeyframe, PlacedKeyframe};
use crate::landmarks::{Neighbour, landmarks};
use crate::options::PlaceOptions;

/// Pose of a frame, and the way driven to it.
#[derive(Clone, Copy, Debug)]
pub struct FramePlacement {
    /// Pose \[m\].
    pub world_from_camera: Pose<World, Camera>,
    /// Way driven from the beginning of the drive \[m\].
    pub way_m: f64,
}

/// Puts keyframes where their frames are, and their landmarks where neighbouring keyframes of the same map see them.
pub fn place_keyframes(
    camera: &PinholeCamera,
    keyframes: Vec<PlaceKeyframe>,
    placement: impl Fn(usize) -> FramePlacement,
    options: &PlaceOptions,
) -> Vec<PlacedKeyframe> {
    let placements: Vec<FramePlacement> = keyframes.iter().map(|k| placement(k.frame)).collect();
    let positions = |k: usize| {
        let (keyframe, own) = (&keyframes[k], &placements[k]);
        let reach = options.landmarks.neighbours;
        let around = k.saturating_sub(reach)..(k + reach + 1).min(keyframes.len());
        let neighbours: Vec<Neighbour<'_>> = around
            .filter(|n| *n != k && keyframes[*n].segment == keyframe.segment)
            .map(|n| Neighbour {
                features: &keyframes[n].features,
                neighbour_from_camera: placements[n].world_from_camera.inverse() * own.world_from_camera,
            })
            .collect();
        landmarks(camera, &keyframe.features, &neighbours, (&options.landmarks, &options.features))
    };
    let all: Vec<_> = (0..keyframes.len()).map(positions).collect();
    let placed = |((keyframe, own), landmarks): ((PlaceKeyframe, FramePlacement), _)| PlacedKeyframe {
        frame: keyframe.frame,
        segment: keyframe.segment,
        world_from_camera: own.world_from_camera,
        way_m: own.way_m,
        features: keyframe.features,
        landmarks,
    };
    keyframes.into_iter().zip(placements).zip(all).map(placed).collect()
}
