//! The scene network: vehicles and road of a frame in one pass (`training/README.md` specifies its outputs).

use std::sync::{Arc, Mutex, PoisonError};

use image::GrayImage;
use motorcade_dataset::Frame;
use rten_tensor::Tensor;
use rten_tensor::prelude::*;

use super::detector_options::DetectorOptions;
use super::engine::Network;
use super::nms::suppress_and_average;
use super::preprocess::{Scale, input};
use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
use crate::detectors::{RoadSegmenter, VehicleDetector};
use crate::error::Result;
use crate::manifest::EdgeErrors;
use crate::road::RoadMask;

/// Classes by channel.
const CLASSES: [VehicleClass; 4] =
    [VehicleClass::Car, VehicleClass::Truck, VehicleClass::Bus, VehicleClass::Motorcycle];
/// Strides of the box outputs \[px of the input\].
const STRIDES: [usize; 2] = [8, 16];
/// Width and height of the input are multiples of this \[px\].
const GRANULARITY: usize = 32;

/// Output of one pass.
#[derive(Clone)]
struct Scene {
    number: u64,
    timestamp_ns: i64,
    detections: Vec<Detection>,
    road: RoadMask,
}

struct Shared {
    network: Network,
    options: DetectorOptions,
    edge_errors: Vec<EdgeErrors>,
    /// Height and width of the input for images of the drive \[px\].
    size: (usize, usize),
    last: Option<Scene>,
}

/// A handle on the scene network; the vehicle detector and the road segmenter of a run share one pass a frame.
#[derive(Clone)]
pub struct SceneNetwork(Arc<Mutex<Shared>>);

impl SceneNetwork {
    /// For images of this size (width, height) \[px\]; `pixels` are those of the input, nearly.
    pub(crate) fn new(
        network: Network,
        image_size: (u32, u32),
        pixels: usize,
        edge_errors: &[EdgeErrors],
        options: &DetectorOptions,
    ) -> Self {
        let (size, edge_errors) = (input_size(image_size, pixels), edge_errors.to_vec());
        Self(Arc::new(Mutex::new(Shared { network, options: *options, edge_errors, size, last: None })))
    }

    fn scene(&self, frame: &Frame) -> Result<Scene> {
        // A pass that panicked leaves the last scene, which belongs to another frame.
        let mut shared = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |s: &&Scene| (s.number, s.timestamp_ns) == (frame.number, frame.timestamp_ns);
        if let Some(scene) = shared.last.as_ref().filter(same) {
            return Ok(scene.clone());
        }
        let scene = shared.pass(frame)?;
        shared.last = Some(scene.clone());
        Ok(scene)
    }

    fn description(&self) -> String {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).network.description()
    }
}

impl Shared {
    fn pass(&self, frame: &Frame) -> Result<Scene> {
        let (image, (height, width)) = (frame.rgb(), self.size);
        let outputs = self.network.run_all(input(&self.network.spec, &image, self.size))?;
        let [boxes8, boxes16, road] = outputs.as_slice() else {
            return Err(self.network.wrong_output(&[outputs.len()], "three outputs: boxes8, boxes16, road"));
        };
        let scale = Scale {
            x: f64::from(image.width()) / width as f64,
            y: f64::from(image.height()) / height as f64,
        };
        let mut detections = Vec::new();
        for (output, stride) in [boxes8, boxes16].into_iter().zip(STRIDES) {
            let shape = [1, CLASSES.len() + 4, height / stride, width / stride];
            let values = self.values(output, &shape)?;
            detections.extend(boxes(&values, (shape[2], shape[3]), stride, scale, self.options.min_score));
        }
        for detection in &mut detections {
            detection.bbox = detection.bbox.clipped(image.width(), image.height());
        }
        let least_px = self.options.advanced.least_side_px;
        detections.retain(|d| d.bbox.width() >= least_px && d.bbox.height() >= least_px);
        let values = self.values(road, &[1, 1, height / 4, width / 4])?;
        let bytes = values.iter().map(|p| (p * 255.0).round().clamp(0.0, 255.0) as u8).collect();
        let mask = GrayImage::from_raw(width as u32 / 4, height as u32 / 4, bytes).unwrap_or_default();
        Ok(Scene {
            number: frame.number,
            timestamp_ns: frame.timestamp_ns,
            detections: suppress_and_average(detections, &self.options.advanced.suppression)
                .into_iter()
                .map(|found| corrected(found, &self.edge_errors, scale, image.dimensions()))
                .collect(),
            road: RoadMask::new(mask, image.width(), image.height()),
        })
    }

    fn values(&self, output: &Tensor<f32>, shape: &[usize]) -> Result<Vec<f32>> {
        if output.shape() != shape {
            return Err(self.network.wrong_output(output.shape(), &format!("{shape:?}")));
        }
        Ok(output.to_vec())
    }
}

/// Boxes of one output `[1, classes + 4, rows, columns]`: scores, then distances left, top, right, bottom \[px of the input\].
fn boxes(
    values: &[f32],
    (rows, columns): (usize, usize),
    stride: usize,
    scale: Scale,
    min_score: f64,
) -> Vec<Detection> {
    let cells = rows * columns;
    let at = |channel: usize, cell: usize| f64::from(values[channel * cells + cell]);
    let mut found = Vec::new();
    for cell in 0..cells {
        let scores = (0..CLASSES.len()).map(|class| (at(class, cell), class));
        let Some((score, class)) = scores.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if score < min_score {
            continue;
        }
        let centre = |index: usize| (index as f64 + 0.5) * stride as f64;
        let (x, y) = (centre(cell % columns), centre(cell / columns));
        let [left, top, right, bottom] = [0, 1, 2, 3].map(|side| at(CLASSES.len() + side, cell));
        // Pixel edges of the input to pixel centres of the image.
        let edges =
            [(x - left) * scale.x, (y - top) * scale.y, (x + right) * scale.x, (y + bottom) * scale.y];
        found.push(Detection {
            class: CLASSES[class],
            score,
            bbox: BoundingBox::new(edges.map(|edge| edge - 0.5)),
            convention: BoxConvention::VisibleExtent,
            external_id: None,
            pixel_size: scale.x.max(scale.y).max(1.0),
            road_below: None,
        });
    }
    found
}

/// Without the mean errors of the edges that lie inside the image of (width, height).
fn corrected(
    found: Detection,
    errors: &[EdgeErrors],
    scale: Scale,
    (width, height): (u32, u32),
) -> Detection {
    let BoundingBox { x1, y1, x2, y2 } = found.bbox;
    let [left, top, right, bottom] = EdgeErrors::at(errors, (y2 - y1) / scale.y);
    let moved = |edge: f64, error: f64, scale: f64, size: u32| {
        let inside = edge > 0.0 && edge < f64::from(size) - 1.0;
        if inside { edge - error * scale } else { edge }
    };
    let bbox = BoundingBox {
        x1: moved(x1, left, scale.x, width),
        y1: moved(y1, top, scale.y, height),
        x2: moved(x2, right, scale.x, width),
        y2: moved(y2, bottom, scale.y, height),
    };
    Detection { bbox: bbox.clipped(width, height), ..found }
}

/// Height and width of the input: about `pixels` in all, near the shape of the image, never larger than it.
fn input_size((width, height): (u32, u32), pixels: usize) -> (usize, usize) {
    let (width, height) = (f64::from(width), f64::from(height));
    let shrink = (pixels as f64 / (width * height)).sqrt().min(1.0);
    let round = |length: f64| ((length * shrink / GRANULARITY as f64).round() as usize).max(1) * GRANULARITY;
    (round(height), round(width))
}

impl VehicleDetector for SceneNetwork {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        Ok(self.scene(frame)?.detections)
    }
    fn description(&self) -> String {
        Self::description(self)
    }
}

impl RoadSegmenter for SceneNetwork {
    fn segment(&mut self, frame: &Frame) -> Result<Option<RoadMask>> {
        Ok(Some(self.scene(frame)?.road))
    }
    fn description(&self) -> String {
        Self::description(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_input_has_the_shape_of_the_image() {
        let pixels = 256 * 832;
        assert_eq!(input_size((1242, 375), pixels), (256, 832));
        assert_eq!(input_size((1280, 720), pixels), (352, 608));
        assert_eq!(input_size((320, 160), pixels), (160, 320));
    }

    #[test]
    fn a_cell_describes_a_box_about_its_centre() {
        // Two cells; the second one is a truck.
        let mut values = vec![0.0; 8 * 2];
        values[2 + 1] = 0.8;
        for (side, distance) in [10.0, 4.0, 6.0, 2.0].into_iter().enumerate() {
            values[(4 + side) * 2 + 1] = distance;
        }
        let found = boxes(&values, (1, 2), 8, Scale { x: 2.0, y: 1.0 }, 0.1);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].class, VehicleClass::Truck);
        assert_eq!(found[0].bbox.to_array(), [3.5, -0.5, 35.5, 5.5]);
    }

    #[test]
    fn boxes_lose_their_mean_errors() {
        let at =
            |height: f64, top: f64, right: f64| EdgeErrors { height, top, right, left: 0.0, bottom: 0.0 };
        let errors = [at(10.0, -2.0, 1.0), at(20.0, 0.0, -1.0)];
        let scale = Scale { x: 2.0, y: 1.0 };
        let found = |edges: [f64; 4]| {
            let detection = Detection {
                class: VehicleClass::Car,
                score: 0.5,
                bbox: BoundingBox::new(edges),
                convention: BoxConvention::VisibleExtent,
                external_id: None,
                pixel_size: 2.0,
                road_below: None,
            };
            corrected(detection, &errors, scale, (100, 80)).bbox.to_array()
        };
        assert_eq!(found([10.0, 20.0, 30.0, 30.0]), [10.0, 22.0, 28.0, 30.0]);
        assert_eq!(found([10.0, 20.0, 30.0, 35.0]), [10.0, 21.0, 30.0, 35.0]);
        // Greater ones have the errors of the last line.
        assert_eq!(found([10.0, 20.0, 30.0, 45.0]), [10.0, 20.0, 32.0, 45.0]);
        // An edge at the border is where the picture ends.
        assert_eq!(found([80.0, 0.0, 99.0, 8.0]), [80.0, 0.0, 99.0, 8.0]);
    }
}
