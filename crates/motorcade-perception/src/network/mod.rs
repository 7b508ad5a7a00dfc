//! Networks, run by `rten` (pure Rust) or, on request, by ONNX Runtime.

mod engine;
mod nms;
#[cfg(feature = "ort")]
mod onnx_runtime;
mod preprocess;
mod pure;
mod segmentation;
mod yolox;

pub use engine::{Engine, Network};
pub use nms::suppress;
pub use segmentation::RoadSegmenter;
pub use yolox::VehicleDetector;
