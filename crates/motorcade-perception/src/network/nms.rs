//! Removes boxes that describe the same vehicle.

use crate::detection::Detection;

/// Two boxes of one class that overlap more than this are one vehicle.
const SAME_CLASS_IOU: f64 = 0.45;
/// A car also found as a truck: the boxes agree better than those of two neighbours.
const OTHER_CLASS_IOU: f64 = 0.6;

/// Non-maximum suppression by class, then among car, van, truck and bus. Best first; equal scores keep their order.
pub fn suppress(mut detections: Vec<Detection>) -> Vec<Detection> {
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Detection> = Vec::new();
    for detection in detections {
        let covered = kept.iter().any(|better| {
            let limit = if better.class == detection.class {
                SAME_CLASS_IOU
            } else if better.class.is_four_wheeled() && detection.class.is_four_wheeled() {
                OTHER_CLASS_IOU
            } else {
                return false;
            };
            better.bbox.iou(&detection.bbox) > limit
        });
        if !covered {
            kept.push(detection);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::{BoundingBox, BoxConvention, VehicleClass};

    fn at(x: f64, class: VehicleClass, score: f64) -> Detection {
        Detection {
            class,
            score,
            bbox: BoundingBox::new([x, 0.0, x + 100.0, 50.0]),
            convention: BoxConvention::VisibleExtent,
            external_id: None,
        }
    }

    #[test]
    fn one_box_a_vehicle() {
        use VehicleClass::{Car, Motorcycle, Truck};
        let kept = suppress(vec![
            at(10.0, Car, 0.5),
            at(0.0, Car, 0.9),
            at(5.0, Truck, 0.6),
            at(40.0, Truck, 0.4),
            at(2.0, Motorcycle, 0.3),
            at(90.0, Car, 0.2),
        ]);
        let left: Vec<_> = kept.iter().map(|d| (d.bbox.x1, d.class)).collect();
        assert_eq!(left, [(0.0, Car), (40.0, Truck), (2.0, Motorcycle), (90.0, Car)]);
    }
}
