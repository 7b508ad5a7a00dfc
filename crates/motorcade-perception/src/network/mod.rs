//! Networks, run by `rten` (pure Rust) or, on request, by ONNX Runtime.

mod engine;
mod nms;
#[cfg(feature = "ort")]
mod onnx_runtime;
mod preprocess;
mod rten_engine;
mod segmentation;
mod yolox;

pub use engine::{Engine, Network};
pub use nms::suppress;
pub use segmentation::RoadNetwork;
pub use yolox::YoloxDetector;
