//! Where the pipeline gets its perception from.

use std::collections::BTreeMap;
use std::path::PathBuf;

use motorcade_dataset::Frame;

use crate::detection::Detection;
use crate::error::Result;
use crate::files::{DetectionTable, RoadMaskFolder};
use crate::models::{ModelOptions, ModelSet};
use crate::network::{Network, RoadSegmenter, VehicleDetector};
use crate::road::RoadMask;

/// What was seen in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Percepts {
    /// Vehicles, best first from networks, in the order of the file from files.
    pub detections: Vec<Detection>,
    /// The road, when something looked for it.
    pub road: Option<RoadMask>,
}

/// Where perception comes from. Files take the place of networks; with neither, nothing is looked for.
#[derive(Clone, Debug, Default)]
pub struct PerceptionOptions {
    /// Folder of networks.
    pub models: Option<PathBuf>,
    /// File of detections.
    pub detections: Option<PathBuf>,
    /// Folder of road masks.
    pub road_masks: Option<PathBuf>,
    /// How networks run.
    pub networks: ModelOptions,
}

#[derive(Debug)]
enum Vehicles {
    NotLookedFor,
    Network(Box<VehicleDetector>),
    File(DetectionTable),
    Remembered(BTreeMap<u64, Vec<Detection>>),
}

#[derive(Debug)]
enum Road {
    NotLookedFor,
    Network(Box<RoadSegmenter>),
    Files(RoadMaskFolder),
    Remembered(BTreeMap<u64, RoadMask>),
}

/// Gives each frame its percepts.
#[derive(Debug)]
pub struct Perception {
    vehicles: Vehicles,
    road: Road,
}

impl Perception {
    /// Looks for nothing.
    pub fn none() -> Self {
        Self { vehicles: Vehicles::NotLookedFor, road: Road::NotLookedFor }
    }

    /// Opens files and networks for frames of this size (width, height) \[px\].
    pub fn open(options: &PerceptionOptions, image_size: (u32, u32)) -> Result<Self> {
        let mut perception = Self::none();
        // With both files given no network has to be loaded.
        let needed = options.detections.is_none() || options.road_masks.is_none();
        if let Some(folder) = options.models.as_deref().filter(|_| needed) {
            let set = ModelSet::load(folder, image_size, &options.networks)?;
            if let Some(detector) = set.vehicles {
                perception.vehicles = Vehicles::Network(Box::new(detector));
            }
            if let Some(segmenter) = set.road {
                perception.road = Road::Network(Box::new(segmenter));
            }
        }
        if let Some(path) = &options.detections {
            perception.vehicles = Vehicles::File(DetectionTable::read(path)?);
        }
        if let Some(folder) = &options.road_masks {
            perception.road = Road::Files(RoadMaskFolder::open(folder)?);
        }
        Ok(perception)
    }

    /// False when no vehicles are looked for, which the results must say.
    pub fn looks_for_vehicles(&self) -> bool {
        !matches!(self.vehicles, Vehicles::NotLookedFor)
    }
    /// False when the road has to be found from geometry.
    pub fn looks_for_road(&self) -> bool {
        !matches!(self.road, Road::NotLookedFor)
    }
    /// Sources in words, for the record of a run: vehicles, road.
    pub fn describe(&self) -> (String, String) {
        let vehicles = match &self.vehicles {
            Vehicles::NotLookedFor => "not looked for".to_owned(),
            Vehicles::Network(detector) => in_words(detector.network()),
            Vehicles::File(table) => format!("{:?} file", table.format()),
            Vehicles::Remembered(_) => "remembered".to_owned(),
        };
        let road = match &self.road {
            Road::NotLookedFor => "not looked for".to_owned(),
            Road::Network(segmenter) => in_words(segmenter.network()),
            Road::Files(_) => "mask files".to_owned(),
            Road::Remembered(_) => "remembered".to_owned(),
        };
        (vehicles, road)
    }

    /// Looks at every frame once; the result answers for them from memory. For many runs on the same frames.
    pub fn remember(&self, frames: impl Iterator<Item = Frame>) -> Result<Self> {
        let (mut vehicles, mut road) = (BTreeMap::new(), BTreeMap::new());
        for frame in frames {
            let percepts = self.perceive(&frame)?;
            vehicles.insert(frame.number, percepts.detections);
            road.extend(percepts.road.map(|mask| (frame.number, mask)));
        }
        Ok(Self {
            vehicles: if self.looks_for_vehicles() {
                Vehicles::Remembered(vehicles)
            } else {
                Vehicles::NotLookedFor
            },
            road: if self.looks_for_road() { Road::Remembered(road) } else { Road::NotLookedFor },
        })
    }

    /// Vehicles and road of one frame.
    pub fn perceive(&self, frame: &Frame) -> Result<Percepts> {
        let detections = match &self.vehicles {
            Vehicles::NotLookedFor => Vec::new(),
            Vehicles::Network(detector) => detector.detect(&frame.rgb())?,
            Vehicles::File(table) => table.of_frame(frame.number).to_vec(),
            Vehicles::Remembered(seen) => seen.get(&frame.number).cloned().unwrap_or_default(),
        };
        let road = match &self.road {
            Road::NotLookedFor => None,
            Road::Network(segmenter) => Some(segmenter.segment(&frame.rgb())?),
            Road::Files(folder) => folder.of_frame(frame.number, frame.size())?,
            Road::Remembered(seen) => seen.get(&frame.number).cloned(),
        };
        Ok(Percepts { detections, road })
    }
}

/// Name of a network, and what runs it where that is not what is built in.
fn in_words(network: &Network) -> String {
    match network.engine() {
        "rten" => format!("network {}", network.name()),
        engine => format!("network {} by {engine}", network.name()),
    }
}
