//! Poses of the frames before a new map.

use nalgebra::{Matrix6, Vector6};

use super::initialisation::Initialisation;
use super::{CameraFromWorld, Frame, Odometry, PolicyOptions};
use crate::map::{Landmark, Observation, PoseRefiner};
use crate::time::{nanoseconds, ratio};
use crate::trajectory::FrameStatus;

impl Odometry {
    /// Poses of the frames from the first to the present one against the new map, and of those before by extrapolation.
    pub(super) fn fill_initial_poses(
        &mut self,
        initialisation: &Initialisation,
        landmarks: &[(usize, Landmark)],
        frame: &Frame<'_>,
        last_pose: &CameraFromWorld,
    ) {
        let first = initialisation.first_frame;
        // Frames at standstill were not kept and share the first pose.
        let standing = initialisation.standing;
        let start_ns = self.trajectory.frames[standing].timestamp_ns;
        let moving_ns = frame.timestamp_ns - start_ns;
        let (mut before, mut refiner) = (CameraFromWorld::identity(), PoseRefiner::default());
        for k in first..frame.number {
            let elapsed_ns = (self.trajectory.frames[k].timestamp_ns - start_ns).max(0);
            let guess = CameraFromWorld::exp(&(last_pose.log() * ratio(elapsed_ns, moving_ns)));
            let at = initialisation.tracks.binary_search_by_key(&k, |tracks| tracks.frame).ok();
            let tracks = at.filter(|_| k > standing).map(|at| &initialisation.tracks[at]);
            let refined = tracks.and_then(|tracks| {
                let observation = |(i, l): &(usize, Landmark)| {
                    Some(Observation { point_in_world: l.point_in_world?, pixel: tracks.pixels[*i]? })
                };
                let observations: Vec<_> = landmarks.iter().filter_map(observation).collect();
                refiner.refine(&self.camera, &guess, &observations, &self.options.advanced.pose)
            });
            let mut record = self.trajectory.frames[k].clone();
            record.segment = self.trajectory.keyframes.len() - 1;
            record.keyframe = 0;
            match refined.filter(|r| r.inlier_count >= self.options.advanced.policy.least_inliers) {
                Some(estimate) => {
                    before = estimate.camera_from_world;
                    record.status = FrameStatus::Tracked;
                    let before_ns = k.checked_sub(1).map_or(0, |b| self.trajectory.frames[b].timestamp_ns);
                    let interval_ns = record.timestamp_ns - before_ns;
                    self.fill_estimate(&mut record, &estimate, interval_ns);
                }
                // The first frame is the origin of the map.
                None if k == first => record.status = FrameStatus::Tracked,
                None if k <= standing => record.status = FrameStatus::Standstill,
                None => before = guess,
            }
            // The first keyframe is the world.
            record.camera_from_keyframe = before.cast();
            self.trajectory.frames[k] = record;
        }
        self.extrapolate_backwards(first);
    }

    /// Frames before the first one of the map (too dark, tracks lost) continue its velocity backwards for a limited time.
    fn extrapolate_backwards(&mut self, first: usize) {
        let segment = self.trajectory.keyframes.len() - 1;
        let most_ns = nanoseconds(self.options.advanced.policy.backwards_s);
        let first_ns = self.trajectory.frames.get(first).map_or(0, |f| f.timestamp_ns);
        for record in self.trajectory.frames[..first].iter_mut().rev() {
            if record.segment != usize::MAX {
                break;
            }
            let age_ns = (first_ns - record.timestamp_ns).clamp(0, most_ns);
            record.segment = segment;
            record.keyframe = 0;
            record.camera_from_keyframe = self.velocity.over(-age_ns);
        }
    }

    /// Adds what two views alone leave undetermined, shared by the steps between them in proportion to time.
    pub(super) fn add_two_view_covariance(&mut self, first: usize, last: usize, last_pose: &CameraFromWorld) {
        let whole = two_view_covariance(last_pose, &self.options.advanced.policy);
        let frames = &mut self.trajectory.frames[first..=last];
        let times_ns: Vec<i64> = frames.iter().map(|f| f.timestamp_ns).collect();
        let elapsed_ns = times_ns[times_ns.len() - 1] - times_ns[0];
        for (record, times) in frames.iter_mut().skip(1).zip(times_ns.windows(2)) {
            let interval_ns = times[1] - times[0];
            if interval_ns > 0 {
                record.covariance += whole / ratio(elapsed_ns, interval_ns);
            }
        }
    }
}

/// Covariance of the motion between two views (6×6 `[ω, ν]`) from their geometry alone. Tracking against their map does not
/// show it, because the points share the error.
fn two_view_covariance(pose: &CameraFromWorld, options: &PolicyOptions) -> Matrix6<f64> {
    let turn = options.two_view_rotation_sigma_rad;
    let aside = options.two_view_direction_sigma_rad * pose.translation().norm();
    let sigmas = Vector6::new(turn, turn, turn, aside, aside, aside);
    Matrix6::from_diagonal(&sigmas.component_mul(&sigmas))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_direction_error_grows_with_the_baseline() {
        let pose = CameraFromWorld::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -2.0));
        let covariance = two_view_covariance(&pose, &PolicyOptions::default());
        assert!((covariance[(3, 3)].sqrt() / 2.0 - 0.4_f64.to_radians()).abs() < 1e-12);
        assert!((covariance[(0, 0)].sqrt() - 0.02_f64.to_radians()).abs() < 1e-12);
    }
}
