//! The local map: recent keyframes and the landmarks they share.

use std::collections::VecDeque;

use motorcade_geometry::PinholeCamera;
use nalgebra::Point3;

use super::baseline_length::BaselineLength;
use super::bundle_problem::{BundleProblem, KeyframeObservation};
use super::keyframe::Keyframe;
use super::landmark::Landmark;
use super::options::WindowOptions;
use super::road_point::RoadPoint;

/// Keyframes and landmarks of the current segment.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    pub(super) options: WindowOptions,
    pub(super) keyframes: VecDeque<Keyframe>,
    /// Landmarks observed from a keyframe of the window.
    pub landmarks: Vec<Landmark>,
}

impl Window {
    /// An empty map.
    pub fn new(options: WindowOptions) -> Self {
        Self { options, keyframes: VecDeque::new(), landmarks: Vec::new() }
    }
    /// Keyframes and landmarks: all but the options.
    pub fn state(&self) -> (&VecDeque<Keyframe>, &Vec<Landmark>) {
        let Self { options: _, keyframes, landmarks } = self;
        (keyframes, landmarks)
    }
    /// The map with these keyframes and landmarks.
    pub fn from_state(
        options: WindowOptions,
        keyframes: VecDeque<Keyframe>,
        landmarks: Vec<Landmark>,
    ) -> Self {
        Self { options, keyframes, landmarks }
    }
    /// Keyframes, oldest first.
    pub fn keyframes(&self) -> impl Iterator<Item = &Keyframe> {
        self.keyframes.iter()
    }
    /// The newest keyframe.
    pub fn newest(&self) -> Option<&Keyframe> {
        self.keyframes.back()
    }
    /// Adds a keyframe and the observations of all tracked landmarks; drops the oldest keyframe of a full window.
    pub fn push(&mut self, keyframe: Keyframe) {
        for landmark in &mut self.landmarks {
            if let Some(pixel) = landmark.pixel {
                landmark.observations.push((keyframe.number, pixel));
            }
        }
        if let Some(before) = self.keyframes.back_mut() {
            let step = keyframe.camera_from_world * before.camera_from_world.inverse();
            before.baseline.close(step.translation().norm());
        }
        self.keyframes.push_back(keyframe);
        let full = self.options.free_keyframes + self.options.fixed_keyframes;
        if self.keyframes.len() > full {
            self.keyframes.pop_front();
        }
        self.remove_old_landmarks();
    }
    fn remove_old_landmarks(&mut self) {
        let oldest = self.keyframes.front().map_or(0, |k| k.number);
        for landmark in &mut self.landmarks {
            landmark.observations.retain(|(number, _)| *number >= oldest);
        }
        self.landmarks
            .retain(|l| l.pixel.is_some() || (l.point_in_world.is_some() && l.observations.len() >= 2));
    }

    /// Index of the keyframe with this number.
    pub(super) fn index_of(&self, number: usize) -> Option<usize> {
        let oldest = self.keyframes.front()?.number;
        number.checked_sub(oldest).filter(|i| *i < self.keyframes.len())
    }

    /// Bundle adjustment of the window; outliers are dropped.
    pub fn adjust(&mut self, camera: &PinholeCamera) {
        if self.keyframes.len() < 3 {
            return;
        }
        let chosen: Vec<usize> = (0..self.landmarks.len())
            .filter(|i| {
                let l = &self.landmarks[*i];
                l.is_static() && l.point_in_world.is_some() && l.observations.len() >= 2
            })
            .collect();
        let free_from = self.keyframes.len().saturating_sub(self.options.free_keyframes).max(2);
        let observations = |i: &usize| -> Vec<KeyframeObservation> {
            let landmark = &self.landmarks[*i];
            let observed = landmark.observations.iter();
            observed
                .filter_map(|(n, pixel)| {
                    let pose = self.index_of(*n)?;
                    let Keyframe { camera_from_world, row_motion, .. } = &self.keyframes[pose];
                    let point = landmark.point_in_world.as_ref()?;
                    let pixel = row_motion.at_frame_time(camera, camera_from_world, point, pixel);
                    Some(KeyframeObservation { pose, pixel })
                })
                .collect()
        };
        let mut problem = BundleProblem {
            poses: self.keyframes.iter().map(|k| k.camera_from_world).collect(),
            fixed: (0..self.keyframes.len()).map(|k| k < free_from).collect(),
            points: chosen.iter().filter_map(|i| self.landmarks[*i].point_in_world).collect(),
            observations: chosen.iter().map(observations).collect(),
            road_points: self.road_points(&chosen),
            lengths: self.lengths(),
        };
        problem.solve(camera, &self.options.bundle);
        for (keyframe, pose) in self.keyframes.iter_mut().zip(&problem.poses) {
            keyframe.camera_from_world = *pose;
        }
        for (i, point) in chosen.into_iter().zip(problem.points) {
            self.accept_point(i, point, camera);
        }
        self.landmarks.retain(|l| l.pixel.is_some() || l.point_in_world.is_some());
    }

    /// Road constraints of the landmarks that lie on the road.
    fn road_points(&self, chosen: &[usize]) -> Vec<Option<RoadPoint>> {
        let mut all: Vec<Option<RoadPoint>> =
            chosen.iter().map(|i| self.road_point(&self.landmarks[*i])).collect();
        let mut counts = vec![0; self.keyframes.len()];
        all.iter().flatten().for_each(|p| counts[p.pose] += 1);
        all.iter_mut().flatten().for_each(|p| *p = p.sharing_plane(counts[p.pose], &self.options));
        all
    }

    /// Road constraint in the newest keyframe that observed the landmark and has a road plane.
    fn road_point(&self, landmark: &Landmark) -> Option<RoadPoint> {
        if !self.options.road_plane || landmark.is_on_vehicle() {
            return None;
        }
        let observers = landmark.observations.iter().rev().filter_map(|(n, _)| self.index_of(*n));
        let (pose, keyframe, m) =
            observers.map(|i| (i, &self.keyframes[i])).find_map(|(i, k)| Some((i, k, k.plane?)))?;
        let point_in_camera = keyframe.camera_from_world.transform_point(&landmark.point_in_world?);
        RoadPoint::new(pose, &m, &point_in_camera, &self.options)
    }

    /// Soft lengths between neighbouring keyframes.
    fn lengths(&self) -> Vec<BaselineLength> {
        let length = |(k, keyframe): (usize, &Keyframe)| {
            let (log_length, sigma) = keyframe.baseline.log_length()?;
            (k + 1 < self.keyframes.len()).then_some(BaselineLength { from: k, to: k + 1, log_length, sigma })
        };
        self.keyframes.iter().enumerate().filter_map(length).collect()
    }

    /// The newest keyframe, to be given road measurements.
    pub fn newest_mut(&mut self) -> Option<&mut Keyframe> {
        self.keyframes.back_mut()
    }

    fn accept_point(&mut self, index: usize, point: Point3<f64>, camera: &PinholeCamera) {
        let Self { keyframes, landmarks, options } = self;
        let oldest = keyframes.front().map_or(0, |k| k.number);
        let landmark = &mut landmarks[index];
        let before = landmark.observations.len();
        landmark.observations.retain(|(number, pixel)| {
            let keyframe = number.checked_sub(oldest).and_then(|i| keyframes.get(i));
            let pose = |k: &Keyframe| k.row_motion.pose_of_row(&k.camera_from_world, pixel.y);
            let projected = keyframe.and_then(|k| camera.project(&pose(k).transform_point(&point)));
            projected.is_some_and(|p| (p - pixel).norm() < options.outlier_px)
        });
        landmark.point_in_world = Some(point);
        // Half of its observations are outliers: it is not a static point.
        if landmark.observations.len() < 2 || 2 * landmark.observations.len() < before {
            landmark.point_in_world = None;
            landmark.pixel = None;
        }
    }
}
