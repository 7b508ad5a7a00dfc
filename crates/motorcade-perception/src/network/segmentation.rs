//! Class maps to road masks.

use image::{GrayImage, RgbImage};
use motorcade_dataset::Frame;
use rten_tensor::prelude::*;

use super::engine::Network;
use super::preprocess::input;
use crate::detectors::RoadSegmenter;
use crate::error::Result;
use crate::road::RoadMask;

/// A segmentation network with classes that are road.
#[derive(Debug)]
pub struct RoadNetwork {
    network: Network,
    road_classes: Vec<usize>,
}

impl RoadNetwork {
    pub(crate) fn new(network: Network, road_classes: Vec<usize>) -> Self {
        Self { network, road_classes }
    }

    /// Finds the road.
    pub fn segment_image(&self, image: &RgbImage) -> Result<RoadMask> {
        let output = self.network.run(input(&self.network.spec, image, self.network.size))?;
        let shape = output.shape().to_vec();
        let last = self.road_classes.iter().copied().max().unwrap_or(0);
        let [1, classes, height, width] = shape[..] else {
            return Err(self.network.wrong_output(&shape, "[1, classes, height, width]"));
        };
        if classes <= last {
            return Err(self
                .network
                .wrong_output(&shape, &format!("[1, {} or more, height, width]", last + 1)));
        }
        let values = output.to_vec();
        let mut sum = vec![0.0_f32; height * width];
        for class in &self.road_classes {
            let plane = &values[class * height * width..][..height * width];
            sum.iter_mut().zip(plane).for_each(|(sum, value)| *sum += value);
        }
        let bytes = sum.iter().map(|p| (p * 255.0).round().clamp(0.0, 255.0) as u8).collect();
        let mask = GrayImage::from_raw(width as u32, height as u32, bytes).unwrap_or_default();
        Ok(RoadMask::new(mask, image.width(), image.height()))
    }
}

impl RoadSegmenter for RoadNetwork {
    fn segment(&mut self, frame: &Frame) -> Result<Option<RoadMask>> {
        self.segment_image(&frame.rgb()).map(Some)
    }
    fn description(&self) -> String {
        self.network.description()
    }
}
