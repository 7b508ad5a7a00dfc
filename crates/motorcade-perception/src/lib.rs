//! What is in a frame: vehicles as boxes, the road as a mask, from networks or from files.
//!
//! Three types to know: [`PerceptionOptions`] says where perception comes from, [`Perception`] gives each frame its
//! [`Percepts`]. Networks are ONNX files described by a [`Manifest`] (`models.toml`) and run in pure Rust:
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
//! Without networks and files nothing is looked for, and [`Perception::looks_for_vehicles`] says so:
//!
//! ```
//! use motorcade_dataset::{Frame, Pixels};
//! use motorcade_perception::{Perception, PerceptionOptions};
//! let perception = Perception::open(&PerceptionOptions::default(), (64, 48))?;
//! let pixels = Pixels::Gray(image::GrayImage::new(64, 48));
//! let frame = Frame { index: 0, number: 0, timestamp_ns: 0, pixels, ignore: None };
//! assert!(!perception.looks_for_vehicles() && perception.perceive(&frame)?.detections.is_empty());
//! # Ok::<(), motorcade_perception::Error>(())
//! ```

mod detection;
mod error;
mod files;
mod manifest;
mod models;
mod network;
mod provider;
mod road;

pub use detection::{BoundingBox, Detection, NoVehicle, VehicleClass};
pub use error::{Error, Result};
pub use files::{DetectionFormat, DetectionTable, RoadMaskFolder};
pub use manifest::{ColourOrder, InputSpec, MANIFEST_NAME, Manifest, ModelEntry, OutputSpec, Resize};
pub use models::{ModelOptions, ModelSet};
pub use network::{Network, RoadSegmenter, VehicleDetector, suppress};
pub use provider::{Perception, PerceptionOptions, Percepts};
pub use road::RoadMask;
