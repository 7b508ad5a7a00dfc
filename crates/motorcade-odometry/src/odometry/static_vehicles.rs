//! Which vehicles stand, told by the landmarks on them.
//!
//! Points on a vehicle that moves along with the traffic still fit a static point, only at another depth: the one at which
//! their image motion would be the camera's doing. The road under the vehicle tells the true depth; where both agree the
//! vehicle stands, and its corners are landmarks as good as those of a house.

use motorcade_geometry::BoundingBox;
use motorcade_geometry::robust::quantile;
use nalgebra::{Point2, Vector3};

use super::{Odometry, Scratch};
use crate::map::Landmark;

/// Beyond this many camera heights (33 m for a car) a box's bottom edge does not tell depth well enough.
const FARTHEST_HEIGHTS: f64 = 20.0;
/// Depth of the near part of a vehicle over that of the road at its bottom edge: a quarter less for boxes that end above the
/// tyres, a fifth more for bodies that recede. An oncoming vehicle shows 0.5 or less, one ahead in traffic 2 or more; within
/// this range lie only those slower than about a fifth of the camera's speed.
const DEPTH_RATIO: std::ops::RangeInclusive<f64> = 0.75..=1.2;
/// Landmarks with a position that must speak.
const LEAST_WITNESSES: usize = 4;
/// A box that ends this near to the bottom of the image is cut off: its contact with the road is not seen \[px\].
const CUT_OFF_PX: f64 = 3.0;

enum Verdict {
    Stands,
    Moves,
    Unknown,
}

impl Odometry {
    /// Judges the vehicles of the last processed frame by the landmarks on them. `boxes` are its detections, `plane` the
    /// road in the camera frame (m with `mᵀX = 1`, in the odometry's unit).
    pub fn classify_static_vehicles(&mut self, boxes: &[BoundingBox], plane: &Vector3<f64>) {
        // The nearest vehicle, lowest in the image, hides those behind it.
        let owner = |p: &Point2<f64>| {
            let around = (0..boxes.len()).filter(|b| boxes[*b].contains(p.x, p.y));
            around.max_by(|a, b| boxes[*a].y2.total_cmp(&boxes[*b].y2))
        };
        let mut scratch = std::mem::take(&mut self.scratch);
        let Scratch { owners, values: depths, .. } = &mut scratch;
        let landmarks = self.window.landmarks.iter();
        owners.clear();
        owners.extend(landmarks.map(|l| l.on_vehicle.and(l.pixel).and_then(|p| owner(&p))));
        for (index, rectangle) in boxes.iter().enumerate() {
            let own = || owners.iter().enumerate().filter(move |(_, o)| **o == Some(index)).map(|(i, _)| i);
            let on_it = || own().map(|i| &self.window.landmarks[i]);
            let verdict = self.verdict(rectangle, on_it, plane, depths);
            for landmark in own() {
                let judged = self.window.landmarks[landmark].on_vehicle.unwrap_or(0);
                self.window.landmarks[landmark].on_vehicle = Some(match verdict {
                    Verdict::Stands => judged.saturating_add(1),
                    Verdict::Moves => 0,
                    Verdict::Unknown => judged,
                });
            }
        }
        self.scratch = scratch;
    }

    /// `depths` is scratch.
    fn verdict<'a, I: Iterator<Item = &'a Landmark>>(
        &self,
        rectangle: &BoundingBox,
        on_it: impl Fn() -> I,
        plane: &Vector3<f64>,
        depths: &mut Vec<f64>,
    ) -> Verdict {
        let Some((_, _, camera_from_world)) = &self.last else { return Verdict::Unknown };
        let bottom = Point2::new(0.5 * (rectangle.x1 + rectangle.x2), rectangle.y2);
        let inverse_depth = plane.dot(&self.camera.ray(&bottom));
        let cut_off = rectangle.y2 > f64::from(self.camera.height) - CUT_OFF_PX;
        if cut_off || inverse_depth * FARTHEST_HEIGHTS < plane.norm() {
            return Verdict::Unknown;
        }
        // A corner detected in the newest keyframe has had no time to show its depth.
        let depth = |l: &Landmark| Some(camera_from_world.transform_point(&l.point_in_world?).z);
        depths.clear();
        depths.extend(on_it().filter_map(depth));
        if depths.len() < LEAST_WITNESSES {
            // Corners that two keyframes saw and that fit no static point: what they are on moves.
            let unfitting = on_it().filter(|l| l.sightings.len() >= 2 && l.point_in_world.is_none());
            return if unfitting.count() >= LEAST_WITNESSES { Verdict::Moves } else { Verdict::Unknown };
        }
        match quantile(depths, 0.25) {
            Some(near) if DEPTH_RATIO.contains(&(near * inverse_depth)) => Verdict::Stands,
            _ => Verdict::Moves,
        }
    }
}
