//! Removes boxes that describe the same vehicle.

use crate::detection::{BoundingBox, Detection};

/// Overlaps (IoU) of boxes that describe the same vehicle. Larger ones keep neighbours in a row apart and leave more vehicles with two boxes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SuppressionOptions {
    /// Two boxes of one class that overlap more than this are one vehicle.
    pub same_class_iou: f64,
    /// Two boxes of different classes: a car also found as a truck. The boxes agree better than those of two neighbours.
    pub other_class_iou: f64,
    /// Two boxes of any class by a network that names its own classes seldom, as the scene network inside the program.
    pub any_class_iou: f64,
    /// Boxes of such a network that agree better than this with the best one of a vehicle are averaged with it.
    pub averaged_iou: f64,
}

impl Default for SuppressionOptions {
    fn default() -> Self {
        Self { same_class_iou: 0.45, other_class_iou: 0.6, any_class_iou: 0.5, averaged_iou: 0.6 }
    }
}

/// Non-maximum suppression by class, then among car, van, truck and bus. Best first; equal scores keep their order.
pub fn suppress(mut detections: Vec<Detection>, options: &SuppressionOptions) -> Vec<Detection> {
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Detection> = Vec::new();
    for detection in detections {
        let covered = kept.iter().any(|better| {
            let limit = if better.class == detection.class {
                options.same_class_iou
            } else if better.class.is_four_wheeled() && detection.class.is_four_wheeled() {
                options.other_class_iou
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

/// Non-maximum suppression of all classes together, where each box kept becomes the mean of those that agree with it,
/// weighted by score² × IoU (box voting: Gidaris and Komodakis, ICCV 2015): edges of single cells scatter. Best first.
pub(super) fn suppress_and_average(
    mut detections: Vec<Detection>,
    options: &SuppressionOptions,
) -> Vec<Detection> {
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut alive = vec![true; detections.len()];
    let mut kept = Vec::new();
    for (i, best) in detections.iter().enumerate() {
        if !alive[i] {
            continue;
        }
        let (mut sum, mut total) = ([0.0; 4], 0.0);
        for (other, alive) in detections.iter().zip(&mut alive) {
            let iou = best.bbox.iou(&other.bbox);
            *alive &= iou <= options.any_class_iou;
            if iou > options.averaged_iou {
                let weight = other.score * other.score * iou;
                total += weight;
                sum.iter_mut().zip(other.bbox.to_array()).for_each(|(sum, edge)| *sum += weight * edge);
            }
        }
        let bbox = if total > 0.0 { BoundingBox::new(sum.map(|s| s / total)) } else { best.bbox };
        kept.push(Detection { bbox, ..*best });
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::{BoxConvention, VehicleClass};

    fn at(x: f64, class: VehicleClass, score: f64) -> Detection {
        Detection {
            class,
            score,
            bbox: BoundingBox::new([x, 0.0, x + 100.0, 50.0]),
            convention: BoxConvention::VisibleExtent,
            external_id: None,
            pixel_size: 1.0,
            road_below: None,
        }
    }

    #[test]
    fn boxes_of_one_vehicle_are_averaged_whatever_their_class() {
        use VehicleClass::{Car, Truck};
        let found = vec![at(0.0, Car, 0.8), at(8.0, Truck, 0.4), at(30.0, Car, 0.3), at(90.0, Car, 0.2)];
        let kept = suppress_and_average(found, &SuppressionOptions::default());
        let classes: Vec<_> = kept.iter().map(|d| d.class).collect();
        assert_eq!(classes, [Car, Car]);
        // The second box (IoU 0.85) counts, the third (0.54) is suppressed without a vote.
        let iou = 92.0 / 108.0;
        let expected = 8.0 * 0.16 * iou / (0.64 + 0.16 * iou);
        assert!((kept[0].bbox.x1 - expected).abs() < 1e-9, "{}", kept[0].bbox.x1);
        assert_eq!(kept[1].bbox.x1, 90.0);
    }

    #[test]
    fn one_box_a_vehicle() {
        use VehicleClass::{Car, Motorcycle, Truck};
        let found = vec![
            at(10.0, Car, 0.5),
            at(0.0, Car, 0.9),
            at(5.0, Truck, 0.6),
            at(40.0, Truck, 0.4),
            at(2.0, Motorcycle, 0.3),
            at(90.0, Car, 0.2),
        ];
        let kept = suppress(found, &SuppressionOptions::default());
        let left: Vec<_> = kept.iter().map(|d| (d.bbox.x1, d.class)).collect();
        assert_eq!(left, [(0.0, Car), (40.0, Truck), (2.0, Motorcycle), (90.0, Car)]);
    }
}
