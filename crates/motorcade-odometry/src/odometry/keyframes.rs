//! Keyframes.

use motorcade_geometry::robust::median;
use nalgebra::Point2;

use super::{CameraFromCamera, CameraFromWorld, Frame, Odometry};
use crate::map::{Carrier, Keyframe, Landmark};
use crate::tracking::{PixelClass, detect};
use crate::trajectory::FrameStatus;

impl Odometry {
    /// True when the image has moved far, or too few landmarks are left. `flow` is scratch.
    pub(super) fn needs_keyframe(&self, flow: &mut Vec<f64>) -> bool {
        let Some(newest) = self.window.newest() else { return false };
        let policy = &self.options.advanced.policy;
        let in_newest = self.window.landmarks.iter().filter(|l| l.is_static()).filter_map(|l| {
            l.observations.last().filter(|(n, _)| *n == newest.number).map(|(_, then)| (l.pixel, then))
        });
        let mut total = 0;
        flow.clear();
        for (now, then) in in_newest {
            total += 1;
            flow.extend(now.map(|p| (p - then).norm()));
        }
        let kept = flow.len() as f64 / f64::from(total.max(1));
        kept < policy.keyframe_kept
            || median(flow).is_none_or(|m| m > policy.keyframe_flow_rad * self.camera.focal_px())
    }

    /// Makes the newest recorded frame a keyframe: triangulation, bundle adjustment, new corners.
    pub(super) fn add_keyframe(&mut self, frame: &Frame<'_>, pose: CameraFromWorld) {
        let segment = self.trajectory.keyframes.len() - 1;
        let number = self.trajectory.keyframes[segment].len();
        self.trajectory.keyframes[segment].push(pose);
        self.window.push(Keyframe::new(number, pose, self.row_motion()));
        self.window.triangulate(&self.camera);
        self.window.adjust(&self.camera);
        for keyframe in self.window.keyframes() {
            self.trajectory.keyframes[segment][keyframe.number] = keyframe.camera_from_world;
        }
        let record = &mut self.trajectory.frames[frame.number];
        record.segment = segment;
        record.keyframe = number;
        record.camera_from_keyframe = CameraFromCamera::identity();
        record.status = FrameStatus::Tracked;
        self.add_landmarks(frame, number);
    }

    /// Detects corners where there is room for more.
    fn add_landmarks(&mut self, frame: &Frame<'_>, keyframe: usize) {
        let class = |p: &Point2<f64>| frame.mask.class(p);
        let occupied: Vec<Point2<f64>> = self.window.landmarks.iter().filter_map(|l| l.pixel).collect();
        let allowed = |x: usize, y: usize| {
            matches!(class(&Point2::new(x as f64, y as f64)), PixelClass::Scene | PixelClass::Vehicle)
        };
        let corners = detect(frame.pyramid.level(0), &occupied, allowed, &self.options.corners);
        let first = self.corners;
        self.corners += corners.len() as u64;
        let landmark = |(id, pixel): (u64, Point2<f64>)| {
            let carrier = match class(&pixel) {
                PixelClass::Vehicle => Carrier::MovingVehicle { static_ns: 0 },
                _ => Carrier::Scene,
            };
            Landmark { carrier, ..Landmark::new(id, pixel, keyframe) }
        };
        self.window.landmarks.extend((first..).zip(corners).map(landmark));
    }

    pub(super) fn newest_pose(&self, fallback: CameraFromWorld) -> CameraFromWorld {
        self.window.newest().map_or(fallback, |k| k.camera_from_world)
    }
}
