//! Keyframes with poses and landmarks.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use nalgebra::Matrix6;

use crate::keyframe::{Landmark, PlaceKeyframe, PlacedKeyframe};
use crate::landmarks::{Neighbour, landmarks};
use crate::options::PlaceOptions;

/// Pose of a frame, and the way driven to it.
#[derive(Clone, Copy, Debug)]
pub struct FramePlacement {
    /// Pose \[m\].
    pub world_from_camera: Pose<World, Camera>,
    /// Its covariance (6×6 `[ω, ν]`, right perturbation; rad, m).
    pub covariance: Matrix6<f64>,
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
    let landmarks: Vec<Vec<Landmark>> =
        (0..keyframes.len()).map(|k| landmarks_of(camera, &keyframes, k, &placement, options)).collect();
    keyframes.into_iter().zip(landmarks).map(|(k, landmarks)| placed(k, &placement, landmarks)).collect()
}

/// The keyframe `k` of some that follow each other, as [`place_keyframes`] places it; `None` where there is none. Landmarks are known as well
/// as among all once `options.advanced.landmarks.neighbours` keyframes follow it.
pub fn place_keyframe(
    camera: &PinholeCamera,
    keyframes: &[PlaceKeyframe],
    k: usize,
    placement: impl Fn(usize) -> FramePlacement,
    options: &PlaceOptions,
) -> Option<PlacedKeyframe> {
    let keyframe = keyframes.get(k)?.clone();
    let landmarks = landmarks_of(camera, keyframes, k, &placement, options);
    Some(placed(keyframe, &placement, landmarks))
}

fn landmarks_of(
    camera: &PinholeCamera,
    keyframes: &[PlaceKeyframe],
    k: usize,
    placement: &impl Fn(usize) -> FramePlacement,
    options: &PlaceOptions,
) -> Vec<Landmark> {
    let (keyframe, reach) = (&keyframes[k], options.advanced.landmarks.neighbours);
    let own = placement(keyframe.frame);
    let around = k.saturating_sub(reach)..(k + reach + 1).min(keyframes.len());
    let neighbours: Vec<Neighbour<'_>> = around
        .filter(|n| *n != k && keyframes[*n].segment == keyframe.segment)
        .map(|n| Neighbour {
            features: &keyframes[n].features,
            neighbour_from_camera: placement(keyframes[n].frame).world_from_camera.inverse()
                * own.world_from_camera,
        })
        .collect();
    landmarks(camera, &keyframe.features, &neighbours, (&options.advanced.landmarks, &options.features))
}

fn placed(
    keyframe: PlaceKeyframe,
    placement: &impl Fn(usize) -> FramePlacement,
    landmarks: Vec<Landmark>,
) -> PlacedKeyframe {
    let FramePlacement { world_from_camera, covariance, way_m } = placement(keyframe.frame);
    let PlaceKeyframe { frame, segment, features, hidden } = keyframe;
    PlacedKeyframe { frame, segment, world_from_camera, covariance, way_m, features, landmarks, hidden }
}
