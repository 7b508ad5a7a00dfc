//! Two tracks on one vehicle.
//!
//! A detector that gives a vehicle two boxes (another class, the cab of a lorry, a rear window) for seconds starts a second track on it. Two vehicles are
//! not seen in one place of the picture for most of their time.

use motorcade_geometry::BoundingBox;

use crate::options::HypothesisOptions;
use crate::trajectory::{VehicleState, VehicleTrajectory};

/// The vehicles without those whose boxes lie on the boxes of another one most of the time; of the two the one with the larger sum of
/// scores stays.
pub fn without_doubles(
    mut vehicles: Vec<VehicleTrajectory>,
    options: &HypothesisOptions,
) -> Vec<VehicleTrajectory> {
    let evidence = |v: &VehicleTrajectory| v.states.iter().map(|s| s.score).sum::<f64>();
    let mut order: Vec<usize> = (0..vehicles.len()).collect();
    order.sort_by(|a, b| evidence(&vehicles[*b]).total_cmp(&evidence(&vehicles[*a])).then(a.cmp(b)));
    let mut kept: Vec<usize> = Vec::new();
    for index in order {
        if !kept.iter().any(|k| is_double(&vehicles[index], &vehicles[*k], options)) {
            kept.push(index);
        }
    }
    let mut index = 0;
    vehicles.retain(|_| {
        index += 1;
        kept.contains(&(index - 1))
    });
    vehicles
}

/// True when boxes of `weak` lie on those of `strong` in most frames that have one.
fn is_double(weak: &VehicleTrajectory, strong: &VehicleTrajectory, options: &HypothesisOptions) -> bool {
    let first = strong.states.first().map_or(0, |s| s.frame);
    let boxes = || weak.states.iter().filter_map(|s| Some((s, s.bbox.filter(|_| s.score > 0.0)?)));
    let on_strong = boxes().filter(|(own, bbox)| {
        let state = own.frame.checked_sub(first).and_then(|k| strong.states.get(k));
        let other = state.and_then(|s| Some((s.score, s.bbox?)));
        other.is_some_and(|(score, other)| {
            let weaker = own.score < options.double_score_ratio * score;
            let second = || is_part(bbox, &other, options) || is_around(bbox, &other, options);
            other.iou(bbox) > options.double_iou || weaker && second()
        })
    });
    let count = boxes().count();
    count > 0 && on_strong.count() as f64 > options.double_share * count as f64
}

/// True when the box of `own` is a weak second one on the box `other` of a vehicle that the detector is surer of.
pub(crate) fn is_second_box(own: &VehicleState, other: &VehicleState, options: &HypothesisOptions) -> bool {
    let boxes = own.bbox.zip(other.bbox);
    own.score < options.double_score_ratio * other.score
        && boxes.is_some_and(|(own, other)| {
            own.iou(&other) > options.double_iou || is_part(&own, &other, options)
        })
}

/// True when a box lies within another one and ends no lower: of a vehicle farther away nothing would be seen there.
fn is_part(part: &BoundingBox, whole: &BoundingBox, options: &HypothesisOptions) -> bool {
    part.y2 <= whole.y2 && part.intersection(whole) > options.double_inside * part.area()
}

/// True when a box holds most of another one and ends no lower: a vehicle with what stands above it far behind, taken for a lorry. The box of a lorry that
/// drives ahead of the vehicle ends at its roof, or scores more.
fn is_around(around: &BoundingBox, vehicle: &BoundingBox, options: &HypothesisOptions) -> bool {
    around.y2 <= vehicle.y2 && around.intersection(vehicle) > options.double_around * vehicle.area()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::standing_car;

    fn vehicle(id: usize, frames: std::ops::Range<usize>, x_px: f64, score: f64) -> VehicleTrajectory {
        let bbox = [x_px, 100.0, x_px + 60.0, 150.0];
        standing_car(id, frames, [0.0; 2]).with_box(bbox).with_scores(|_| score)
    }

    fn ids(vehicles: Vec<VehicleTrajectory>) -> Vec<usize> {
        without_doubles(vehicles, &HypothesisOptions::default()).iter().map(|v| v.id).collect()
    }

    #[test]
    fn the_weaker_of_two_on_one_vehicle_goes() {
        // The second lies on the first, the third beside it, the fourth on it after its end.
        let all = vec![
            vehicle(1, 10..30, 200.0, 0.4),
            vehicle(2, 0..40, 205.0, 0.8),
            vehicle(3, 0..40, 240.0, 0.8),
            vehicle(4, 38..60, 205.0, 0.8),
        ];
        assert_eq!(ids(all), [2, 3, 4]);
        assert!(ids(Vec::new()).is_empty());
        // A part of it that scores little, and one that scores as much: a motorcycle in front of a lorry.
        let part = |id: usize, score: f64| {
            let mut part = vehicle(id, 0..40, 205.0, score);
            for bbox in part.states.iter_mut().filter_map(|s| s.bbox.as_mut()) {
                *bbox = BoundingBox::new([bbox.x1, bbox.y1, bbox.x1 + 25.0, bbox.y2 - 20.0]);
            }
            part
        };
        assert_eq!(ids(vec![vehicle(1, 0..40, 200.0, 0.8), part(2, 0.2), part(3, 0.7)]), [1, 3]);
        // It with the house behind, which scores little, and a lorry ahead of it.
        let around = |id: usize, score: f64| {
            let mut around = vehicle(id, 0..40, 200.0, score);
            for bbox in around.states.iter_mut().filter_map(|s| s.bbox.as_mut()) {
                *bbox = BoundingBox::new([bbox.x1 - 5.0, bbox.y1 - 60.0, bbox.x2 + 5.0, bbox.y2 - 6.0]);
            }
            around
        };
        assert_eq!(ids(vec![vehicle(1, 0..40, 200.0, 0.8), around(2, 0.3), around(3, 0.6)]), [1, 3]);
    }
}
