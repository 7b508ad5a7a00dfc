//! Detectors of vehicles, their keypoints and the road in single frames: networks, files, or a caller's own types.
//!
//! Three things to know: the traits [`VehicleDetector`], [`RoadSegmenter`] and [`KeypointDetector`]; [`Perception`], which
//! holds one of each and gives each frame its [`Observations`]; [`PerceptionOptions`], which opens networks and files. Networks are ONNX files described by a [`Manifest`] (`models.toml`) and run in pure Rust:
//!
//! ```toml
//! [[model]]
//! name = "my-detector"
//! file = "my_detector.onnx"
//! licence = "Apache-2.0"
//! sha256 = "..."                     # optional, checked
//! input = { colour = "bgr", resize = "letterbox", scale = 1.0, mean = [0, 0, 0], std = [1, 1, 1] }
//! output = { kind = "yolox", classes = { 2 = "Car", 5 = "Bus", 7 = "Truck" } }
//! ```
//!
//! With the feature `ort` (off by default) ONNX Runtime takes the place of `rten`. It is not linked but loaded at run time,
//! and nothing is fetched while building: `pip install onnxruntime`, or a package of the system, brings the library, and
//! `ORT_DYLIB_PATH` names the file (of the wheel: `onnxruntime/capi/libonnxruntime.so.*`) when the system does not find it
//! as `libonnxruntime.so`. ONNX Runtime 1.17 or newer. Where it does not load, opening networks fails with
//! [`Error::Engine`]: no run changes its engine unnoticed. [`ModelOptions::engine`] asks for `rten` all the
//! same. On one KITTI frame with the development networks, ONNX Runtime 1.31 and one thread of a busy two-core machine, box
//! edges agreed with `rten` within 1e-4 px and scores within 1e-6, in 116 ms instead of 642 ms (best of five, both
//! networks); `tests/engines.rs` measures it again.
//!
//! A detector of one's own is one type:
//!
//! ```
//! use motorcade_dataset::{Frame, Pixels};
//! use motorcade_perception::{BoundingBox, BoxConvention, Detection, Perception, Result, VehicleClass, VehicleDetector};
//!
//! /// Finds a car in the middle of every picture.
//! struct Middle;
//! impl VehicleDetector for Middle {
//!     fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
//!         let (w, h) = (f64::from(frame.size().0), f64::from(frame.size().1));
//!         let bbox = BoundingBox::new([0.4 * w, 0.4 * h, 0.6 * w, 0.6 * h]);
//!         let convention = BoxConvention::VisibleExtent;
//!         Ok(vec![Detection { class: VehicleClass::Car, score: 0.5, bbox, convention, external_id: None, pixel_size: 1.0, road_below: None }])
//!     }
//!     fn description(&self) -> String {
//!         "the middle".to_owned()
//!     }
//! }
//!
//! let mut perception = Perception::none().with_detector(Middle);
//! let pixels = Pixels::Gray(image::GrayImage::new(64, 48));
//! let frame = Frame { index: 0, number: 0, timestamp_ns: 0, pixels, ignore: None };
//! assert_eq!(perception.observe(&frame)?.detections.len(), 1);
//! # Ok::<(), motorcade_perception::Error>(())
//! ```

mod detection;
mod detectors;
mod digest;
mod embedded;
mod error;
mod files;
mod fixed_regions;
mod inventory;
mod keypoints;
mod manifest;
mod models;
mod network;
mod observations;
mod perception;
mod recording;
mod replay;
mod road;
mod trial;

pub use detection::{BoundingBox, BoxConvention, Detection, NoVehicle, VehicleClass};
pub use detectors::{KeypointDetector, RoadSegmenter, VehicleDetector};
pub use error::{Error, Result};
pub use files::{
    Checkpoint, DetectionFormat, DetectionTable, Identity, KeptObservations, KeypointTable, RoadMaskFolder,
    SkippedFrame,
};
pub use fixed_regions::{FixedRegionOptions, FixedRegions, connected_regions};
pub use inventory::{ModelInfo, list_models};
pub use keypoints::VehicleKeypoints;
pub use manifest::{
    ColourOrder, InputSpec, KeypointVariance, MANIFEST_NAME, Manifest, ModelEntry, OutputSpec,
    PresenceWeights, Resize,
};
pub use models::{ModelSet, ModelSource};
pub use network::{
    AdvancedDetectorOptions, BoxDetector, CropOptions, DetectorOptions, Engine, KeypointNetwork,
    ModelOptions, Network, RoadNetwork, SceneNetwork, SuppressionOptions, suppress,
};
pub use observations::Observations;

pub use perception::{Perception, PerceptionOptions};
pub use recording::Recording;
pub use road::{RoadBelowOptions, RoadMask};
pub use trial::try_models;
