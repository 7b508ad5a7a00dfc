//! The networks inside the program find the vehicles of a rendered frame.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade_dataset::Frame;
use motorcade_perception::{BoundingBox, ModelOptions, ModelSet, ModelSource};
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
