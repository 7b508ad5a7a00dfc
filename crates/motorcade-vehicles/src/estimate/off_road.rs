//! Something beside the road that seems to drive ahead.
//!
//! The boxes of a house that is called a lorry, `k` times as far as a lorry would be, are those of a lorry that drives along with the camera
//! at `1 − 1/k` of its speed. What drives has road below it in the picture; a house has not, nor has a car that is parked beside the road.

use super::input::TrackInput;
use crate::motion::{Line, PositionMeasurement};

/// Factor on P(moving): below 1 for a track with no road below it that appears to drive ahead, as the camera does. Traffic that
/// comes the other way is often seen behind a barrier, which hides its road.
pub(super) fn factor(input: &TrackInput<'_>, positions: &[PositionMeasurement]) -> f64 {
    let options = &input.options.advanced.kinematic_state;
    let off_road = road_below(input).is_some_and(|share| share < options.least_road_below);
    if off_road && drives_ahead(input, positions) { options.off_road_factor } else { 1.0 }
}

/// Mean probability of road below the boxes, where it shows in enough of them.
fn road_below(input: &TrackInput<'_>) -> Option<f64> {
    let boxes = &input.track.boxes;
    let (count, sum) = boxes
        .iter()
        .filter_map(|b| b.observed.road_below)
        .fold((0, 0.0), |(n, sum), share| (n + 1, sum + share));
    (count >= input.options.advanced.kinematic_state.least_road_boxes.max(1)).then(|| sum / count as f64)
}

/// True when the apparent velocity points where the camera drives, more along its way than across it: that of something that stands and is further
/// away than it seems, or of boxes that a tracker took from one vehicle of a row after the other. What crosses the way does not.
fn drives_ahead(input: &TrackInput<'_>, positions: &[PositionMeasurement]) -> bool {
    let Some((first, last)) = positions.first().zip(positions.last()) else { return false };
    let centre = |frame: usize| input.grounds[frame].world_from_camera.translation();
    let way = centre(last.frame) - centre(first.frame);
    let velocity = Line::new(positions, &input.options.advanced.kinematic_state).velocity();
    velocity.dot(&way) > velocity.cross(&way).norm()
}
