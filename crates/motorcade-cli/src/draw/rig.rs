//! The camera on its car, as a run found it.

use motorcade::{RunRecord, RunResult};
use motorcade_geometry::BoundingBox;

/// Height of the camera, and what of the picture is fixed to it.
pub struct Rig {
    /// Height above the road \[m\].
    pub height_m: f64,
    /// Rectangles around a bonnet and the like \[px\].
    pub fixed_regions: Vec<BoundingBox>,
}

impl Rig {
    /// Of results.
    pub fn of(result: &RunResult) -> Self {
        Self { height_m: result.ego.height_m, fixed_regions: result.fixed_regions.clone() }
    }

    /// Of a record; `None` where it states no height of the camera.
    pub fn recorded(record: &RunRecord) -> Option<Self> {
        let fixed_regions =
            record.fixed_regions_px.iter().map(|corners| BoundingBox::new(*corners)).collect();
        Some(Self { height_m: record.camera_height_m?, fixed_regions })
    }
}
