//! Vehicles of the frames, found once and used in every pass.

use motorcade_dataset::Frame;
use motorcade_geometry::BoundingBox;
use motorcade_perception::{DetectorOptions, Perception};

use crate::error::Result;

/// Boxes of the frames.
pub(super) struct VehicleBoxes {
    perception: Perception,
    rows: Vec<Option<Vec<BoundingBox>>>,
}

impl VehicleBoxes {
    pub(super) fn new(perception: Perception) -> Self {
        Self { perception, rows: Vec::new() }
    }

    /// Boxes of a frame.
    pub(super) fn of(&mut self, row: usize, frame: &Frame) -> Result<&[BoundingBox]> {
        if self.rows.len() <= row {
            self.rows.resize(row + 1, None);
        }
        if self.rows[row].is_none() {
            let detections = self.perception.observe(frame)?.detections;
            let least = DetectorOptions::default().masking_score;
            let boxes = detections.iter().filter(|d| d.score >= least).map(|d| d.bbox);
            self.rows[row] = Some(boxes.collect());
        }
        Ok(self.rows[row].as_deref().unwrap_or_default())
    }
}
