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
//! With the feature `ort` (off by default) ONNX Runtime takes the place of `rten`. It is not linked but loaded at run time,
//! and nothing is fetched while building: `pip install onnxruntime`, or a package of the system, brings the library, and
//! `ORT_DYLIB_PATH` names the file (of the wheel: `onnxruntime/capi/libonnxruntime.so.*`) when the system does not find it
//! as `libonnxruntime.so`. ONNX Runtime 1.17 or newer. Where it does not load, opening networks fails with
//! [`Error::Engine`] and says so: no run changes its engine unnoticed. [`ModelOptions::engine`] asks for `rten` all the
//! same. On one KITTI frame with the development networks, ONNX Runtime 1.31 and one thread of a busy two-core machine, box
//! edges agreed with `rten` within 1e-4 px and scores within 1e-6, in 116 ms instead of 642 ms (best of five, both
//! networks); `tests/engines.rs` measures it again.
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
mod keypoints;
mod manifest;
mod models;
mod network;
mod provider;
mod road;

pub use detection::{BoundingBox, BoxConvention, Detection, NoVehicle, VehicleClass};
pub use error::{Error, Result};
pub use files::{DetectionFormat, DetectionTable, KeypointTable, RoadMaskFolder};
pub use keypoints::VehicleKeypoints;
pub use manifest::{ColourOrder, InputSpec, MANIFEST_NAME, Manifest, ModelEntry, OutputSpec, Resize};
pub use models::{ModelOptions, ModelSet};
pub use network::{Engine, Network, RoadSegmenter, VehicleDetector, suppress};
pub use provider::{Perception, PerceptionOptions, Percepts};
pub use road::RoadMask;
