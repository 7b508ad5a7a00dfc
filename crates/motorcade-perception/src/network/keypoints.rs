//! The vehicle network: crops around boxes to keypoints (`training/README.md` specifies its outputs).

use motorcade_dataset::Frame;
use motorcade_shape::{Layout, ObservedKeypoint};
use nalgebra::Point2;
use rten_tensor::prelude::*;
use rten_tensor::{Layout as _, NdTensor};

use super::crop::{CropFrame, INPUT_PX};
use super::engine::Network;
use crate::detection::{Detection, VehicleClass};
use crate::detectors::KeypointDetector;
use crate::error::Result;
use crate::keypoints::VehicleKeypoints;

/// Cells of a heat map along each axis.
const CELLS: usize = 16;
/// Cells on each side of the peak that its position is the mean of.
const REACH: usize = 2;

/// Choice of the boxes that are cropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CropOptions {
    /// Least height of a box \[px\]: below, keypoints are less certain than the box.
    pub min_height_px: f64,
    /// Least score of a box.
    pub min_score: f64,
    /// Crops a frame at most, largest first: each costs time.
    pub max_crops: usize,
}

impl Default for CropOptions {
    fn default() -> Self {
        Self { min_height_px: 20.0, min_score: 0.3, max_crops: 8 }
    }
}

/// A network that finds the 36 keypoints of `car-36` in crops.
pub struct KeypointNetwork {
    network: Network,
    options: CropOptions,
}

impl KeypointNetwork {
    pub(crate) fn new(network: Network, options: CropOptions) -> Self {
        Self { network, options }
    }

    /// Boxes to look at, largest first.
    fn chosen<'d>(&self, detections: &'d [Detection]) -> Vec<&'d Detection> {
        let CropOptions { min_height_px, min_score, max_crops } = self.options;
        let known = |d: &&Detection| matches!(d.class, VehicleClass::Car | VehicleClass::Van);
        let large =
            |d: &&Detection| d.bbox.height() >= min_height_px && d.bbox.width() >= 0.5 * min_height_px;
        let mut chosen: Vec<&Detection> =
            detections.iter().filter(|d| d.score >= min_score).filter(known).filter(large).collect();
        chosen.sort_by(|a, b| b.bbox.area().total_cmp(&a.bbox.area()));
        chosen.truncate(max_crops);
        chosen
    }
}

impl KeypointDetector for KeypointNetwork {
    fn keypoints(&mut self, frame: &Frame, detections: &[Detection]) -> Result<Vec<VehicleKeypoints>> {
        let chosen = self.chosen(detections);
        if chosen.is_empty() {
            return Ok(Vec::new());
        }
        let image = frame.rgb();
        let crops: Vec<CropFrame> = chosen.iter().map(|d| CropFrame::of_box(&d.bbox)).collect();
        let mut data = Vec::with_capacity(crops.len() * 4 * INPUT_PX * INPUT_PX);
        crops.iter().for_each(|crop| crop.append(&image, &mut data));
        let outputs =
            self.network.run_all(NdTensor::from_data([crops.len(), 4, INPUT_PX, INPUT_PX], data))?;
        let count = Layout::Car36.count();
        let [heat, visibility, ..] = outputs.as_slice() else {
            return Err(self.network.wrong_output(&[outputs.len()], "heatmaps, visibility and others"));
        };
        if heat.shape() != [crops.len(), count, CELLS, CELLS] || visibility.shape() != [crops.len(), count] {
            return Err(self.network.wrong_output(heat.shape(), "[N, 36, 16, 16] and [N, 36]"));
        }
        let (heat, visibility) = (heat.to_vec(), visibility.to_vec());
        let maps = heat.chunks_exact(count * CELLS * CELLS).zip(visibility.chunks_exact(count));
        let keypoints = |(k, (maps, visibility)): (usize, (&[f32], &[f32]))| {
            let point = |(map, logit): (&[f32], &f32)| {
                let [x, y] = peak(map);
                let [u, v] = crops[k].pixel(x, y);
                ObservedKeypoint { pixel: Point2::new(u, v), confidence: logistic(f64::from(*logit)) }
            };
            let points = maps.chunks_exact(CELLS * CELLS).zip(visibility).map(point).collect();
            VehicleKeypoints { layout: Layout::Car36, points, bbox: chosen[k].bbox }
        };
        Ok(maps.enumerate().map(keypoints).collect())
    }

    fn description(&self) -> String {
        self.network.description()
    }
}

fn logistic(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

/// Position of a keypoint in a map of logits, 0..1 from edge to edge: the softmax's mean over the cells about the largest.
fn peak(map: &[f32]) -> [f64; 2] {
    let best = (0..map.len()).max_by(|a, b| map[*a].total_cmp(&map[*b]).then(b.cmp(a))).unwrap_or(0);
    let (row, column) = (best / CELLS, best % CELLS);
    let range = |centre: usize| centre.saturating_sub(REACH)..(centre + REACH + 1).min(CELLS);
    let (mut x, mut y, mut total) = (0.0, 0.0, 0.0);
    for r in range(row) {
        for c in range(column) {
            let weight = f64::from(map[r * CELLS + c] - map[best]).exp();
            x += weight * (c as f64 + 0.5);
            y += weight * (r as f64 + 0.5);
            total += weight;
        }
    }
    [x / (total * CELLS as f64), y / (total * CELLS as f64)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_between_two_cells_is_half_way() {
        let mut map = vec![-20.0; CELLS * CELLS];
        map[5 * CELLS + 7] = 3.0;
        map[5 * CELLS + 8] = 3.0;
        let [x, y] = peak(&map);
        assert!((x - 8.0 / 16.0).abs() < 1e-6 && (y - 5.5 / 16.0).abs() < 1e-6, "{x} {y}");
    }
}
