//! The path of the camera over the ground: where it drove after a frame, and straight on from the end of the drive.

use nalgebra::{Point2, Vector2};

use crate::output_options::AdvancedOutputOptions;
use crate::result::RunResult;

/// Positions of the camera in the horizontal plane of the world (x, z).
pub(crate) struct PathAhead {
    points: Vec<Point2<f64>>,
    /// For each frame the camera's place and the index of the first point after it.
    frames: Vec<(Point2<f64>, usize)>,
    /// Length of path that is looked at \[m\].
    look_ahead_m: f64,
}

/// A place relative to the path from a frame on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaceOnPath {
    /// Way from the camera along the path \[m\]; negative behind it.
    pub(crate) way_m: f64,
    /// Distance to the right of the path \[m\].
    pub(crate) offset_m: f64,
    /// Direction of the path there.
    pub(crate) direction: Vector2<f64>,
}

impl PathAhead {
    pub(crate) fn new(result: &RunResult, options: &AdvancedOutputOptions) -> Self {
        let frames = &result.ego.frames;
        let positions = frames.iter().map(|f| f.world_from_camera.translation());
        let axis = frames.last().map(|f| f.world_from_camera.rotation_matrix().column(2).into_owned());
        let end = axis.map_or_else(Vector2::y, |axis| Vector2::new(axis.x, axis.z));
        Self::through(positions.map(|t| Point2::new(t.x, t.z)), &end, options)
    }

    /// Through positions frame by frame, and on from the last one.
    fn through(
        positions: impl Iterator<Item = Point2<f64>>,
        on: &Vector2<f64>,
        options: &AdvancedOutputOptions,
    ) -> Self {
        let AdvancedOutputOptions { path_spacing_m, look_ahead_m, .. } = *options;
        let mut points: Vec<Point2<f64>> = Vec::new();
        let mut frames = Vec::new();
        for position in positions {
            if points.last().is_none_or(|last| (position - last).norm() >= path_spacing_m) {
                points.push(position);
            }
            frames.push((position, points.len()));
        }
        let direction = on.try_normalize(1e-9).unwrap_or_else(Vector2::y);
        if let Some((end, _)) = frames.last() {
            points
                .extend([path_spacing_m, look_ahead_m + path_spacing_m].map(|way_m| end + direction * way_m));
        }
        Self { points, frames, look_ahead_m }
    }

    /// Where a point lies along the path from a frame on; `None` beyond what is looked at.
    pub(crate) fn locate(&self, frame: usize, point: &Point2<f64>) -> Option<PlaceOnPath> {
        let (start, next) = *self.frames.get(frame)?;
        let mut best: Option<(f64, PlaceOnPath)> = None;
        let (mut from, mut way_m) = (start, 0.0);
        for (k, to) in self.points.get(next..)?.iter().enumerate() {
            let length_m = (to - from).norm();
            if length_m < 1e-6 {
                continue;
            }
            let direction = (to - from) / length_m;
            let relative = point - from;
            // The first piece reaches backwards too.
            let least = if k == 0 { f64::NEG_INFINITY } else { 0.0 };
            let along_m = relative.dot(&direction).clamp(least, length_m);
            let distance = (relative - direction * along_m).norm();
            if best.as_ref().is_none_or(|(least, _)| distance < *least) {
                // x to the right, z ahead.
                let offset_m = direction.y * relative.x - direction.x * relative.y;
                let offset_m = if along_m < length_m { offset_m } else { distance.copysign(offset_m) };
                best = Some((distance, PlaceOnPath { way_m: way_m + along_m, offset_m, direction }));
            }
            way_m += length_m;
            if way_m > self.look_ahead_m {
                break;
            }
            from = *to;
        }
        best.map(|(_, place)| place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a circle of 30 m to the right, then standing.
    fn bend() -> PathAhead {
        let on_circle = |k: usize| {
            let (sin, cos) = (k.min(90) as f64).to_radians().sin_cos();
            Point2::new(30.0 * (1.0 - cos), 30.0 * sin)
        };
        PathAhead::through((0..120).map(on_circle), &Vector2::x(), &AdvancedOutputOptions::default())
    }

    #[test]
    fn places_follow_the_bend() {
        let path = bend();
        let (sin, cos) = 60_f64.to_radians().sin_cos();
        // 2 m outside of the circle, a third of the way further than 20 degrees.
        let place = path.locate(20, &Point2::new(30.0 - 32.0 * cos, 32.0 * sin)).unwrap();
        assert!((place.way_m - 30.0 * 40_f64.to_radians()).abs() < 0.2, "{place:?}");
        assert!((place.offset_m + 2.0).abs() < 0.05, "{place:?}");
        assert!((place.direction - Vector2::new(sin, cos)).norm() < 0.05, "{place:?}");
    }

    #[test]
    fn behind_is_negative_and_the_end_goes_straight_on() {
        let path = bend();
        assert!((path.locate(0, &Point2::new(1.0, -5.0)).unwrap().way_m + 5.0).abs() < 0.1);
        let place = path.locate(119, &Point2::new(70.0, 29.0)).unwrap();
        assert!((place.way_m - 40.0).abs() < 0.1 && (place.offset_m - 1.0).abs() < 0.1, "{place:?}");
    }
}
