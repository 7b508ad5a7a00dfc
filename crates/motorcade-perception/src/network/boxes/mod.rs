//! Networks that find boxes of vehicles in an image, by the family of their output.

mod centre_point;
mod ssd;
mod yolox;

use image::RgbImage;
use motorcade_dataset::Frame;
use rten_tensor::Tensor;

use super::detector_options::DetectorOptions;
use super::engine::Network;
use super::nms::{SuppressionOptions, suppress};
use super::preprocess::{input, scale};
use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
use crate::detectors::VehicleDetector;
use crate::error::Result;
use crate::manifest::BoxFamily;

/// A network that finds vehicles.
#[derive(Debug)]
pub struct BoxDetector {
    network: Network,
    family: BoxFamily,
    classes: Classes,
    suppression: SuppressionOptions,
    /// Least width and height of a box \[px\].
    least_side_px: f64,
}

/// A box before it is brought back to the image.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    class: VehicleClass,
    score: f64,
    /// Left, top, right, bottom at pixel edges of the input \[px\].
    edges_px: [f64; 4],
}

/// Classes of a network that are vehicles, and the least score of a box.
#[derive(Debug)]
struct Classes {
    /// Class number of the network and what it is.
    known: Vec<(usize, VehicleClass)>,
    min_score: f64,
}

impl Classes {
    /// The largest class number.
    fn last(&self) -> usize {
        self.known.iter().map(|(number, _)| *number).max().unwrap_or(0)
    }
    /// The best vehicle class by a score a class, when good enough.
    fn best(&self, score: impl Fn(usize) -> f64) -> Option<(f64, VehicleClass)> {
        let scored = self.known.iter().map(|(number, class)| (score(*number), *class));
        scored.filter(|(score, _)| *score >= self.min_score).max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

impl VehicleDetector for BoxDetector {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        self.detect_in(&frame.rgb())
    }
    fn description(&self) -> String {
        self.network.description()
    }
}

impl BoxDetector {
    pub(crate) fn new(
        network: Network,
        family: BoxFamily,
        classes: Vec<(usize, VehicleClass)>,
        options: &DetectorOptions,
    ) -> Self {
        let classes = Classes { known: classes, min_score: options.min_score };
        Self {
            network,
            family,
            classes,
            suppression: options.advanced.suppression,
            least_side_px: options.advanced.least_side_px,
        }
    }

    /// Finds vehicles, best first.
    pub fn detect_in(&self, image: &RgbImage) -> Result<Vec<Detection>> {
        let size = self.network.size;
        let outputs = self.network.run_all(input(&self.network.spec, image, size))?;
        let back = scale(&self.network.spec, image.dimensions(), size);
        let detection = |candidate: Candidate| {
            let [x1, y1, x2, y2] = candidate.edges_px;
            // Pixel edges of the input to pixel centres of the image.
            let bbox = [x1 * back.x, y1 * back.y, x2 * back.x, y2 * back.y].map(|edge| edge - 0.5);
            let bbox = BoundingBox::new(bbox).clipped(image.width(), image.height());
            (bbox.width() >= self.least_side_px && bbox.height() >= self.least_side_px).then_some(Detection {
                class: candidate.class,
                score: candidate.score,
                bbox,
                convention: BoxConvention::VisibleExtent,
                external_id: None,
                pixel_size: back.x.max(back.y).max(1.0),
                road_below: None,
            })
        };
        let found = self.decode(&outputs, size)?.into_iter().filter_map(detection).collect();
        Ok(suppress(found, &self.suppression))
    }

    fn decode(&self, outputs: &[Tensor<f32>], size: (usize, usize)) -> Result<Vec<Candidate>> {
        let decoded = match self.family {
            BoxFamily::Yolox => yolox::decode(outputs, size, &self.classes),
            BoxFamily::Ssd => ssd::decode(outputs, size, &self.classes),
            BoxFamily::CentrePoint => centre_point::decode(outputs, size, &self.classes),
        };
        decoded.map_err(|wrong| self.network.wrong_output(&wrong.found, &wrong.expected))
    }
}

/// An output of another shape than the family has.
#[derive(Debug, PartialEq)]
struct WrongOutput {
    found: Vec<usize>,
    expected: String,
}

impl WrongOutput {
    fn new(found: &[usize], expected: impl Into<String>) -> Self {
        Self { found: found.to_vec(), expected: expected.into() }
    }
}
