//! The networks inside the program find the vehicles of a rendered frame.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade_dataset::Frame;
use motorcade_perception::{
    BoundingBox, BoxConvention, Detection, ModelOptions, ModelSet, ModelSource, VehicleClass,
};
use motorcade_simulate::{RenderOptions, Renderer, Scenario, simulate};

/// Least height of vehicles that must be detected \[px\].
const LEAST_PX: f64 = 40.0;

#[test]
fn unhidden_vehicles_are_found() {
    let drive = simulate(&Scenario::by_name("demo").unwrap(), 41, 11, &RenderOptions::default()).unwrap();
    let picture = Renderer::new(&drive).render(40).unwrap();
    let frame = Frame::from_rgb(picture.rgb.clone(), 0);
    let set = ModelSet::open(&ModelSource::Embedded, frame.size(), &ModelOptions::default()).unwrap();
    let found = set.vehicles.unwrap().detect(&frame).unwrap();
    let visible = picture.views.iter().filter(|v| v.visible_share() > 0.95).filter_map(|v| v.visible_px);
    let wanted: Vec<BoundingBox> = visible.map(BoundingBox::new).filter(|b| b.height() >= LEAST_PX).collect();
    assert!(!wanted.is_empty());
    for bbox in wanted {
        let best = found.iter().filter(|d| d.score > 0.3).map(|d| d.bbox.iou(&bbox)).fold(0.0, f64::max);
        assert!(best > 0.5, "{bbox:?}: best overlap {best}");
    }
}

/// Boxes of a rendered frame on vehicles that are seen whole, and boxes of a car's shape where no vehicle is.
fn boxes_with_and_without(views: &[[f64; 4]], all: &[BoundingBox]) -> [Vec<BoundingBox>; 2] {
    let with = views.iter().map(|b| BoundingBox::new(*b)).filter(|b| b.height() >= LEAST_PX).collect();
    let places = (0..10).flat_map(|column| [150.0, 230.0].map(|top| (60.0 + 115.0 * f64::from(column), top)));
    let boxes = places.map(|(left, top)| BoundingBox::new([left, top, left + 80.0, top + 60.0]));
    let without = boxes.filter(|b| all.iter().all(|other| other.iou(b) == 0.0)).collect();
    [with, without]
}

#[test]
fn boxes_with_a_vehicle_are_told_from_boxes_without() {
    let drive = simulate(&Scenario::by_name("demo").unwrap(), 41, 11, &RenderOptions::default()).unwrap();
    let picture = Renderer::new(&drive).render(40).unwrap();
    let frame = Frame::from_rgb(picture.rgb.clone(), 0);
    let whole: Vec<[f64; 4]> =
        picture.views.iter().filter(|v| v.visible_share() > 0.95).filter_map(|v| v.visible_px).collect();
    let all: Vec<BoundingBox> =
        picture.views.iter().filter_map(|v| v.visible_px).map(BoundingBox::new).collect();
    for (k, boxes) in boxes_with_and_without(&whole, &all).into_iter().enumerate() {
        assert!(!boxes.is_empty());
        for class in [VehicleClass::Car, VehicleClass::Truck] {
            // One box a call: the network takes the largest few of a frame.
            for bbox in &boxes {
                let set =
                    ModelSet::open(&ModelSource::Embedded, frame.size(), &ModelOptions::default()).unwrap();
                let detection = Detection {
                    class,
                    score: 0.6,
                    bbox: *bbox,
                    convention: BoxConvention::VisibleExtent,
                    external_id: None,
                    pixel_size: 1.0,
                    road_below: None,
                };
                let found = set.keypoints.unwrap().keypoints(&frame, &[detection]).unwrap();
                assert_eq!(found[0].any_found(), class == VehicleClass::Car, "only cars have keypoints");
                let presence = found[0].presence.unwrap();
                assert_eq!(presence > 0.0, k == 0, "{class:?} {bbox:?}: {presence}");
            }
        }
    }
}
