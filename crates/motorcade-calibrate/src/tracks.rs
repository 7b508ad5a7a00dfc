//! Corners followed through the keyframes of the odometry.

use std::collections::BTreeMap;

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{FrameStatus, Odometry};
use nalgebra::Point2;

/// Keyframe and pixel of each observation of a corner, in order.
pub(crate) type Track = Vec<(usize, Point2<f64>)>;
/// Tracks by the number of their corner.
type Tracks = BTreeMap<u64, Track>;

/// Observations of the keyframes of a drive, map by map.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrackRecorder {
    /// The last keyframe recorded: map and number.
    last: Option<(usize, usize)>,
    maps: BTreeMap<usize, Tracks>,
}

/// A map of the odometry: where its keyframes are and what they see.
#[derive(Clone, Debug)]
pub(crate) struct MapTracks {
    /// `camera_from_world` of the keyframes.
    pub poses: Vec<Pose<Camera, World>>,
    /// Corners that three keyframes or more see.
    pub tracks: Vec<Track>,
}

/// Map and number of the keyframe that the newest frame is tracked by; `None` where it is lost, or tracked by an older keyframe.
pub(crate) fn newest_keyframe(odometry: &Odometry) -> Option<(usize, usize)> {
    let trajectory = odometry.trajectory();
    let record = trajectory.frames.last().filter(|r| r.status == FrameStatus::Tracked)?;
    let keyframes = trajectory.keyframes.get(record.segment)?;
    (keyframes.len() == record.keyframe + 1).then_some((record.segment, record.keyframe))
}

impl TrackRecorder {
    /// Takes what a new keyframe sees, after [`Odometry::process`]. Corners on vehicles are left out.
    pub fn observe(&mut self, odometry: &Odometry) {
        let Some(newest) = newest_keyframe(odometry).filter(|newest| self.last != Some(*newest)) else {
            return;
        };
        self.last = Some(newest);
        let map = self.maps.entry(newest.0).or_default();
        for landmark in odometry.landmarks().iter().filter(|l| !l.is_on_vehicle()) {
            // The first keyframes of a map are recorded with the one that begins it.
            for (number, pixel) in &landmark.observations {
                let track = map.entry(landmark.id).or_default();
                if track.last().is_none_or(|(last, _)| last < number) {
                    track.push((*number, *pixel));
                }
            }
        }
    }

    /// Ends the drive.
    pub fn finish(self, odometry: Odometry) -> Vec<MapTracks> {
        let trajectory = odometry.finish();
        let map = |(segment, tracks): (usize, Tracks)| MapTracks {
            poses: trajectory.keyframes[segment].clone(),
            tracks: tracks.into_values().filter(|t| t.len() >= 3).collect(),
        };
        self.maps.into_iter().map(map).collect()
    }
}
