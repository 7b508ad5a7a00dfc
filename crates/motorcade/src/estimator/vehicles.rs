//! The vehicles of a window of frames, each for itself.

use std::cell::RefCell;
use std::collections::BTreeMap;

use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_perception::{Detection, VehicleKeypoints};
use motorcade_vehicles::{
    ExternalTrack, GroundFrame, KeypointFitters, KeypointTrack, KeypointViews, KinematicStateOptions, Track,
    VehicleState, VehicleTrajectory, boxes_of, estimate_consistently, estimate_track, explain_boxes,
    external_tracks, join_in_one_place, join_parted, measure_road_ahead, measure_slope_changes,
    with_hiding_checked, without_clutter, without_doubles,
};

use crate::record::FrameInfo;
use crate::settings::Settings;

/// Inputs of vehicle estimation; one entry a frame of the window.
pub(crate) struct VehicleInput<'a> {
    pub(crate) frames: &'a [FrameInfo],
    pub(crate) detections: &'a [Vec<Detection>],
    pub(crate) keypoints: &'a [Vec<VehicleKeypoints>],
    pub(crate) grounds: &'a [GroundFrame],
    pub(crate) fitters: &'a KeypointFitters,
}

/// Keypoints of tracks that were fitted before, by identity, in a window that moves on.
pub(crate) struct KnownKeypoints<'a> {
    /// Row of the run of each frame of the window.
    pub(crate) rows: &'a [usize],
    pub(crate) tracks: &'a mut BTreeMap<usize, KeypointTrack>,
}

/// The fitters of a run's keypoints.
pub(crate) fn keypoint_fitters(settings: &Settings) -> KeypointFitters {
    KeypointFitters::new(settings.external.shape_prior.as_ref(), &settings.config.vehicles.advanced)
}

/// Estimates the vehicles of a window; `track` links boxes to tracks, frames counted from the first of the window. External
/// poses bring their own identities. Without `known`, in the window of a whole drive, boxes that a track's vehicle does not explain may
/// become vehicles of their own. When asked to stop it returns the vehicles estimated so far, as their tracks alone have them.
pub(crate) fn estimate_vehicles(
    input: &VehicleInput<'_>,
    settings: &Settings,
    known: Option<KnownKeypoints<'_>>,
    stop: &dyn Fn() -> bool,
    track: impl FnOnce() -> Vec<Track>,
) -> Vec<VehicleTrajectory> {
    let VehicleInput { frames, detections, grounds, .. } = *input;
    let Settings { camera, config, external, .. } = settings;
    let options = &config.vehicles;
    let whole_drive = known.is_none();
    if let Some(poses) = &external.vehicles {
        let numbers: Vec<u64> = frames.iter().map(|f| f.number).collect();
        let tracks = external_tracks(poses, &numbers, grounds, detections, camera, options);
        let estimate = |(track, external): &(Track, ExternalTrack)| {
            estimate_track(camera, grounds, track, external, options)
        };
        let mut vehicles: Vec<_> = tracks.iter().filter_map(estimate).collect();
        if !whole_drive {
            mix_undecided(&mut vehicles, &options.advanced.kinematic_state);
        }
        return vehicles;
    }
    let mut tracks = track();
    let keypoints: Vec<&[VehicleKeypoints]> = input.keypoints.iter().map(Vec::as_slice).collect();
    let any = keypoints.iter().any(|of_frame| !of_frame.is_empty());
    let fits = KeypointViews::new(&keypoints, input.fitters, camera, grounds, &options.advanced);
    let least_presence = options.advanced.hypothesis.least_presence;
    tracks.retain(|track| fits.presence(track).is_none_or(|odds| odds >= least_presence));
    let known = RefCell::new(known);
    let views = |track: &Track| match known.borrow_mut().as_mut() {
        _ if !any => ExternalTrack::default(),
        None => fits.of_track(track),
        Some(KnownKeypoints { rows, tracks }) => {
            let known = tracks.entry(track.id).or_insert_with(|| KeypointTrack::new(track.class));
            fits.of_known(track, known, &|frame| rows[frame])
        }
    };
    let mut next_id = tracks.iter().map(|t| t.id + 1).max().unwrap_or(0);
    let mut found: Vec<(VehicleTrajectory, Track)> = Vec::with_capacity(tracks.len());
    for track in tracks.iter().take_while(|_| !stop()) {
        let next_id = whole_drive.then_some(&mut next_id);
        for vehicle in estimate_consistently(camera, grounds, track, &views, options, next_id) {
            let boxes =
                boxes_of(track, &vehicle).unwrap_or_else(|| Track { boxes: Vec::new(), ..track.clone() });
            found.push((vehicle, boxes));
        }
    }
    let (mut vehicles, tracks) = if whole_drive {
        explain_boxes((camera, grounds), found, &views, (options, &config.tracker), stop)
    } else {
        found.into_iter().unzip()
    };
    if whole_drive && !stop() {
        let again =
            |track: &Track| estimate_consistently(camera, grounds, track, &views, options, None).pop();
        let estimate = |track: &Track| if stop() { None } else { again(track) };
        vehicles = with_hiding_checked(vehicles, &tracks, camera, grounds, options, estimate);
        let options = (options, &config.tracker);
        vehicles = without_clutter(vehicles, &tracks, camera, grounds, options, estimate);
    }
    if !whole_drive {
        mix_undecided(&mut vehicles, &options.advanced.kinematic_state);
    }
    vehicles.sort_by_key(|v| v.id);
    let vehicles = without_doubles(vehicles, &options.advanced.hypothesis);
    // Online a vehicle keeps the identity of its track while the window moves on.
    if !whole_drive || stop() {
        return vehicles;
    }
    let gap_s = config.tracker.longest_gap_s;
    let vehicles = join_parted((camera, grounds), vehicles, &tracks, &views, options, gap_s);
    join_in_one_place(vehicles, grounds, &options.advanced)
}

/// Vehicles that may stand or move as the mean of both: the last seconds may yet tell otherwise.
fn mix_undecided(vehicles: &mut [VehicleTrajectory], options: &KinematicStateOptions) {
    let undecided = vehicles.iter_mut().filter(|v| options.is_undecided(v.p_moving));
    undecided.flat_map(|v| &mut v.states).for_each(VehicleState::mix_rival);
}

/// Times of frames \[s\], from the first.
pub(crate) fn times_s(frames: &[FrameInfo]) -> Vec<f64> {
    let start_ns = frames.first().map_or(0, |f| f.timestamp_ns);
    frames.iter().map(|f| (f.timestamp_ns - start_ns) as f64 * 1e-9).collect()
}

/// Camera and road of each frame; times count from `start_ns`. Nothing is known of the heights of a trajectory from a file.
pub(crate) fn ground_frames(
    ego: &EgoTrajectory,
    frames: &[FrameInfo],
    start_ns: i64,
    settings: &Settings,
) -> Vec<GroundFrame> {
    let one = |(e, f): (&EgoFrame, &FrameInfo)| GroundFrame {
        world_from_camera: e.world_from_camera,
        up: e.road_normal,
        height_m: ego.height_m,
        pitch_sigma_rad: e.road_tilt_covariance[(0, 0)].max(0.0).sqrt(),
        slope_change_sigma_rad: 0.0,
        road_ahead: None,
        time_s: (f.timestamp_ns - start_ns) as f64 * 1e-9,
    };
    let mut grounds: Vec<GroundFrame> = ego.frames.iter().zip(frames).map(one).collect();
    let own = settings.external.trajectory.is_none();
    let measure = if own { measure_road_ahead } else { measure_slope_changes };
    measure(&mut grounds, &settings.config.vehicles.advanced.box_fit);
    grounds
}
