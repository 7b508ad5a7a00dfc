//! The networks of a folder.

use std::path::Path;
use std::sync::Arc;

use rten::ThreadPool;

use crate::detection::VehicleClass;
use crate::detectors::{RoadSegmenter, VehicleDetector};
use crate::error::Result;
use crate::manifest::{Manifest, OutputSpec, Resize};
use crate::network::{Engine, Network, RoadNetwork, YoloxDetector};

/// How networks run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelOptions {
    /// Threads of one network; at least 1. The result is the same for any number.
    pub threads: usize,
    /// Vehicles less certain than this are not handed out, 0 to 1. Low, because tracking tells chance from vehicles.
    pub min_score: f64,
    /// What runs them.
    pub engine: Engine,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self { threads: 1, min_score: 0.1, engine: Engine::default() }
    }
}

/// One network a purpose, those of the folder that suit the image best.
pub struct ModelSet {
    /// Finds vehicles.
    pub vehicles: Option<Box<dyn VehicleDetector>>,
    /// Finds the road.
    pub road: Option<Box<dyn RoadSegmenter>>,
}

impl std::fmt::Debug for ModelSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let vehicles = self.vehicles.as_ref().map(|network| network.description());
        let road = self.road.as_ref().map(|network| network.description());
        f.debug_struct("ModelSet").field("vehicles", &vehicles).field("road", &road).finish()
    }
}

impl ModelSet {
    /// Loads the networks of a folder for images of this size (width, height) \[px\].
    ///
    /// # Errors
    /// A manifest that does not read, a network that does not load or takes no images.
    pub fn load(folder: &Path, image_size: (u32, u32), options: &ModelOptions) -> Result<Self> {
        let manifest = Manifest::of_folder(folder)?;
        let threads = Arc::new(ThreadPool::with_num_threads(options.threads.max(1)));
        let mut vehicles: Option<(f64, Box<dyn VehicleDetector>)> = None;
        let mut road: Option<(f64, Box<dyn RoadSegmenter>)> = None;
        for entry in &manifest.models {
            let network = Network::load(folder, entry, options, &threads)?;
            let fit = misfit(&network, entry.input.resize, image_size);
            match &entry.output {
                OutputSpec::Yolox { classes } => {
                    if vehicles.as_ref().is_none_or(|(best, _)| fit < *best) {
                        let detector = YoloxDetector::new(network, numbered(classes), options.min_score);
                        vehicles = Some((fit, Box::new(detector)));
                    }
                }
                OutputSpec::Segmentation { road: classes } => {
                    if road.as_ref().is_none_or(|(best, _)| fit < *best) {
                        road = Some((fit, Box::new(RoadNetwork::new(network, classes.clone()))));
                    }
                }
            }
        }
        Ok(Self { vehicles: vehicles.map(|(_, network)| network), road: road.map(|(_, network)| network) })
    }
}

/// How badly an input suits an image; smaller is better, and of equals the smaller input.
fn misfit(network: &Network, resize: Resize, (image_width, image_height): (u32, u32)) -> f64 {
    let (width, height) = network.input_size();
    let (x, y) = (f64::from(image_width) / width as f64, f64::from(image_height) / height as f64);
    let pixels = (width * height) as f64;
    match resize {
        // Detail lost by shrinking: distant vehicles are small.
        Resize::Letterbox => x.max(y).max(1.0).ln() + 1e-9 * pixels,
        // Distortion of shapes.
        Resize::Stretch => (x / y).ln().abs() + 1e-9 * pixels,
    }
}

fn numbered(classes: &std::collections::BTreeMap<String, VehicleClass>) -> Vec<(usize, VehicleClass)> {
    // The manifest has been checked: every key is a number.
    classes.iter().filter_map(|(key, class)| Some((key.parse().ok()?, *class))).collect()
}
