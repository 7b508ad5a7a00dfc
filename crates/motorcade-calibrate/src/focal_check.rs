//! Check of a stated focal length by the turns of a drive, on tracks that the odometry of the run has anyway.

use std::collections::BTreeMap;

use motorcade_geometry::PinholeCamera;
use motorcade_odometry::Odometry;

use crate::adjustment::Adjustment;
use crate::calibrator::kernel_px;
use crate::estimate::LensEstimate;
use crate::focal_check_options::FocalCheckOptions;
use crate::lens::Lens;
use crate::options::CalibrateOptions;
use crate::prior::LensPrior;
use crate::tracks::{MapTracks, Track, newest_keyframe};
use crate::window::Window;

/// Collects stretches of a drive in which the camera turns, and estimates the focal length from them. A few hundred kB, whatever the drive.
#[derive(Clone, Debug)]
pub struct FocalCheck {
    options: FocalCheckOptions,
    stated: Lens,
    width: u32,
    /// Map and number of the last keyframe taken.
    last: Option<(usize, usize)>,
    /// Number of the first keyframe of the stretch.
    first: usize,
    tracks: BTreeMap<u64, Track>,
    /// The best stretches, the one that turns most first.
    windows: Vec<Window>,
}

/// State of a [`FocalCheck`] after a frame, without camera and options.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct FocalCheckState {
    last: Option<(usize, usize)>,
    first: usize,
    tracks: BTreeMap<u64, Track>,
    windows: Vec<Window>,
}

impl FocalCheck {
    /// For a camera; `None` where its pixels are not square.
    pub fn new(camera: &PinholeCamera, options: FocalCheckOptions) -> Option<Self> {
        let square = (camera.fx / camera.fy).ln().abs() <= options.square;
        let stated = Lens { focal_px: (camera.fx * camera.fy).sqrt(), k1: 0.0, cx: camera.cx, cy: camera.cy };
        square.then(|| Self {
            options,
            stated,
            width: camera.width,
            last: None,
            first: 0,
            tracks: BTreeMap::new(),
            windows: Vec::new(),
        })
    }

    /// The state after the last frame.
    pub fn state(&self) -> FocalCheckState {
        let Self { options: _, stated: _, width: _, last, first, tracks, windows } = self;
        FocalCheckState { last: *last, first: *first, tracks: tracks.clone(), windows: windows.clone() }
    }

    /// As after the frame of a state, which came from a check of the same camera with the same options.
    pub fn restore(&mut self, state: FocalCheckState) {
        let FocalCheckState { last, first, tracks, windows } = state;
        (self.last, self.first, self.tracks, self.windows) = (last, first, tracks, windows);
    }

    /// The focal length stated \[px\].
    pub fn stated_px(&self) -> f64 {
        self.stated.focal_px
    }

    /// Takes what a new keyframe sees, after [`Odometry::process`]. Corners on vehicles are left out.
    pub fn observe(&mut self, odometry: &Odometry) {
        let Some(newest) = newest_keyframe(odometry).filter(|newest| self.last != Some(*newest)) else {
            return;
        };
        let (segment, keyframe) = newest;
        let begins = self.last.is_none_or(|(before, _)| before != segment);
        // The bundle adjustment moves the poses of the newest keyframes.
        let settling = odometry.options().advanced.window.free_keyframes;
        if begins || keyframe >= self.first + self.options.window_keyframes + settling {
            self.close(odometry);
            self.first = if begins { 0 } else { keyframe };
        }
        self.last = Some(newest);
        for landmark in odometry.landmarks().iter().filter(|l| !l.is_on_vehicle()) {
            let observed =
                landmark.observations.iter().filter_map(|(n, p)| Some((n.checked_sub(self.first)?, *p)));
            for (number, pixel) in observed.filter(|(number, _)| *number < self.options.window_keyframes) {
                let track = self.tracks.entry(landmark.id).or_default();
                if track.last().is_none_or(|(last, _)| *last < number) {
                    track.push((number, pixel));
                }
            }
        }
    }

    /// Ends a stretch: it is kept if the camera turns clearly more in it than in one of those kept.
    fn close(&mut self, odometry: &Odometry) {
        let tracks = std::mem::take(&mut self.tracks);
        let Some((segment, newest)) = self.last else { return };
        let end = (self.first + self.options.window_keyframes).min(newest + 1);
        let Some(poses) = odometry.trajectory().keyframes.get(segment).and_then(|k| k.get(self.first..end))
        else {
            return;
        };
        let turn_rad: f64 =
            poses.windows(2).map(|p| (p[1].rotation() * p[0].rotation().inverse()).angle()).sum();
        let full = self.windows.len() == self.options.most_windows;
        let better =
            !full || self.windows.last().is_some_and(|w| turn_rad > self.options.more_turn * w.turn_rad());
        if turn_rad < self.options.least_turn_rad || !better {
            return;
        }
        let mut tracks: Vec<Track> = tracks.into_values().filter(|t| t.len() >= 3).collect();
        tracks.sort_by_key(|track| std::cmp::Reverse(track.len()));
        tracks.truncate(self.options.most_corners);
        let map = MapTracks { poses: poses.to_vec(), tracks };
        let least_corners = CalibrateOptions::default().advanced.least_corners;
        self.windows.extend(Window::new(&map, 0..map.poses.len(), &self.stated, least_corners));
        self.windows.sort_by(|a, b| b.turn_rad().total_cmp(&a.turn_rad()));
        self.windows.truncate(self.options.most_windows);
    }

    /// The focal length by the drive; `None` where the camera turned too little.
    pub fn finish(mut self, odometry: &Odometry) -> Option<LensEstimate> {
        self.close(odometry);
        if self.windows.is_empty() {
            return None;
        }
        let mut options = CalibrateOptions::default();
        options.advanced.max_iterations = self.options.max_iterations;
        let prior = LensPrior::new(
            self.stated,
            [self.options.log_focal_sigma, options.k1_sigma],
            self.width,
            &options,
        );
        let mut adjustment = Adjustment { lens: self.stated, windows: self.windows };
        adjustment.solve(&prior, &options);
        let noise_px = LensEstimate::new(&adjustment, &prior, &options).noise_px();
        options.advanced.kernel_px = kernel_px(noise_px, &options);
        adjustment.solve(&prior, &options);
        Some(LensEstimate::new(&adjustment, &prior, &options))
    }
}
