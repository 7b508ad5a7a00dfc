//! The networks of a folder.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rten::ThreadPool;

use crate::detection::VehicleClass;
use crate::detectors::{KeypointDetector, RoadSegmenter, VehicleDetector};
use crate::embedded;
use crate::error::Result;
use crate::manifest::{Manifest, ModelEntry, OutputSpec, Resize};
use crate::network::{BoxDetector, KeypointNetwork, ModelOptions, Network, RoadNetwork, SceneNetwork};

/// Source of the networks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ModelSource {
    /// The networks inside the binary.
    #[default]
    Embedded,
    /// A folder of ONNX files with a `models.toml`.
    Folder(PathBuf),
    /// No networks.
    None,
}

/// One network a purpose, those that suit the image best.
#[derive(Default)]
pub struct ModelSet {
    /// Finds vehicles.
    pub vehicles: Option<Box<dyn VehicleDetector>>,
    /// Finds the road.
    pub road: Option<Box<dyn RoadSegmenter>>,
    /// Finds keypoints of vehicles.
    pub keypoints: Option<Box<dyn KeypointDetector>>,
}

impl std::fmt::Debug for ModelSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let vehicles = self.vehicles.as_ref().map(|network| network.description());
        let road = self.road.as_ref().map(|network| network.description());
        let keypoints = self.keypoints.as_ref().map(|network| network.description());
        f.debug_struct("ModelSet")
            .field("vehicles", &vehicles)
            .field("road", &road)
            .field("keypoints", &keypoints)
            .finish()
    }
}

/// A network of a purpose and how badly it suits the image.
struct Candidate<T: ?Sized> {
    misfit: f64,
    network: Box<T>,
}

/// Keeps the better one; of equals the first.
fn keep<T: ?Sized>(best: &mut Option<Candidate<T>>, misfit: f64, network: Box<T>) {
    if best.as_ref().is_none_or(|b| misfit < b.misfit) {
        *best = Some(Candidate { misfit, network });
    }
}

impl ModelSet {
    /// Opens the networks of a source for images of this size (width, height) \[px\].
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn open(source: &ModelSource, image_size: (u32, u32), options: &ModelOptions) -> Result<Self> {
        match source {
            ModelSource::Folder(folder) => Self::load(folder, image_size, options),
            ModelSource::Embedded => Self::embedded(image_size, options),
            ModelSource::None => Ok(Self::default()),
        }
    }

    /// Loads the networks of a folder for images of this size (width, height) \[px\].
    ///
    /// A damaged file is an error. Networks of others are to be tried in a process of their own ([`try_models`](crate::try_models)), as
    /// `motorcade run` does: a whole one can ask for any amount of memory, already for constants that the engine computes while it
    /// loads, and an allocation that fails ends the process.
    ///
    /// # Errors
    /// A manifest that does not read, a network that does not load or takes no images.
    pub fn load(folder: &Path, image_size: (u32, u32), options: &ModelOptions) -> Result<Self> {
        let manifest = Manifest::of_folder(folder)?;
        let load =
            |entry: &ModelEntry, threads: &Arc<ThreadPool>| Network::load(folder, entry, options, threads);
        Self::build(&manifest, image_size, options, load)
    }

    /// The networks inside the binary.
    fn embedded(image_size: (u32, u32), options: &ModelOptions) -> Result<Self> {
        let entries = embedded::entries()?;
        let manifest = Manifest { models: entries.iter().map(|(entry, _)| entry.clone()).collect() };
        Self::build(&manifest, image_size, options, |entry, threads| {
            let path = PathBuf::from(format!("embedded {}", entry.file));
            let bytes = entries.iter().find(|(e, _)| e.file == entry.file).map(|(_, bytes)| bytes.to_vec());
            Network::from_bytes(path, bytes.unwrap_or_default(), entry, options, threads)
        })
    }

    pub(crate) fn build(
        manifest: &Manifest,
        image_size: (u32, u32),
        options: &ModelOptions,
        load: impl Fn(&ModelEntry, &Arc<ThreadPool>) -> Result<Network>,
    ) -> Result<Self> {
        let threads = Arc::new(ThreadPool::with_num_threads(options.threads.max(1)));
        let mut vehicles: Option<Candidate<dyn VehicleDetector>> = None;
        let mut road: Option<Candidate<dyn RoadSegmenter>> = None;
        let mut keypoints: Option<Candidate<dyn KeypointDetector>> = None;
        for entry in &manifest.models {
            let network = load(entry, &threads)?;
            if let Some((family, classes)) = entry.output.boxes() {
                let misfit = misfit(&network, entry.input.resize, image_size);
                let detector = BoxDetector::new(network, family, numbered(classes), &options.detectors);
                keep(&mut vehicles, misfit, Box::new(detector));
                continue;
            }
            match &entry.output {
                OutputSpec::Segmentation { road: classes } => {
                    let misfit = misfit(&network, entry.input.resize, image_size);
                    keep(&mut road, misfit, Box::new(RoadNetwork::new(network, classes.clone())));
                }
                OutputSpec::Scene { pixels, road: with_road, edge_errors } => {
                    let scene =
                        SceneNetwork::new(network, image_size, *pixels, edge_errors, &options.detectors);
                    keep(&mut vehicles, 0.0, Box::new(scene.clone()));
                    if *with_road {
                        keep(&mut road, 0.0, Box::new(scene));
                    }
                }
                OutputSpec::Keypoints { variance, presence } => {
                    let network =
                        KeypointNetwork::new(network, *variance, *presence, options.detectors.advanced.crops);
                    keep(&mut keypoints, 0.0, Box::new(network));
                }
                OutputSpec::Yolox { .. } | OutputSpec::Ssd { .. } | OutputSpec::CentrePoint { .. } => {}
            }
        }
        Ok(Self {
            vehicles: vehicles.map(|c| c.network),
            road: road.map(|c| c.network),
            keypoints: keypoints.map(|c| c.network),
        })
    }
}

/// Misfit between an input and an image; of equals the smaller input is preferred.
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
