//! The vehicles of a window of frames, each for itself.

use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_perception::{Detection, VehicleKeypoints};
use motorcade_vehicles::{
    ExternalTrack, GroundFrame, KeypointViews, Track, VehicleTrajectory, estimate_track, external_tracks,
};

use crate::record::FrameInfo;
use crate::settings::Settings;

/// Inputs of vehicle estimation; one entry a frame of the window.
pub(crate) struct VehicleInput<'a> {
    pub(crate) frames: &'a [FrameInfo],
    pub(crate) detections: &'a [Vec<Detection>],
    pub(crate) keypoints: &'a [Vec<VehicleKeypoints>],
    pub(crate) grounds: &'a [GroundFrame],
}

/// Estimates the vehicles of a window; `track` links boxes to tracks, frames counted from the first of the window. External
/// poses bring their own identities.
pub(crate) fn estimate_vehicles(
    input: &VehicleInput<'_>,
    settings: &Settings,
    track: impl FnOnce() -> Vec<Track>,
) -> Vec<VehicleTrajectory> {
    let VehicleInput { frames, detections, grounds, .. } = *input;
    let Settings { camera, config, external, .. } = settings;
    let options = &config.vehicles;
    let tracks: Vec<(Track, ExternalTrack)> = match &external.vehicles {
        Some(poses) => {
            let numbers: Vec<u64> = frames.iter().map(|f| f.number).collect();
            external_tracks(poses, &numbers, grounds, detections, camera, options)
        }
        None => with_keypoints(track(), input, settings),
    };
    let estimate = |(track, external): &(Track, ExternalTrack)| {
        estimate_track(camera, grounds, track, external, options)
    };
    tracks.iter().filter_map(estimate).collect()
}

/// Tracks with the views from their keypoints.
fn with_keypoints(
    tracks: Vec<Track>,
    input: &VehicleInput<'_>,
    settings: &Settings,
) -> Vec<(Track, ExternalTrack)> {
    if input.keypoints.iter().all(Vec::is_empty) {
        return tracks.into_iter().map(|t| (t, ExternalTrack::default())).collect();
    }
    let keypoints: Vec<&[VehicleKeypoints]> = input.keypoints.iter().map(Vec::as_slice).collect();
    let (prior, options) =
        (settings.external.shape_prior.as_ref(), &settings.config.vehicles.advanced.keypoints);
    let views = KeypointViews::new(&keypoints, prior, &settings.camera, input.grounds, options);
    tracks.into_iter().map(|t| (views.of_track(&t), t)).map(|(views, t)| (t, views)).collect()
}

/// Times of frames \[s\], from the first.
pub(crate) fn times_s(frames: &[FrameInfo]) -> Vec<f64> {
    let start_ns = frames.first().map_or(0, |f| f.timestamp_ns);
    frames.iter().map(|f| (f.timestamp_ns - start_ns) as f64 * 1e-9).collect()
}

/// Camera and road of each frame; times count from `start_ns`.
pub(crate) fn ground_frames(ego: &EgoTrajectory, frames: &[FrameInfo], start_ns: i64) -> Vec<GroundFrame> {
    let one = |(e, f): (&EgoFrame, &FrameInfo)| GroundFrame {
        world_from_camera: e.world_from_camera,
        up: e.road_normal,
        height_m: ego.height_m,
        pitch_sigma_rad: e.road_tilt_covariance[(0, 0)].max(0.0).sqrt(),
        time_s: (f.timestamp_ns - start_ns) as f64 * 1e-9,
    };
    ego.frames.iter().zip(frames).map(one).collect()
}
