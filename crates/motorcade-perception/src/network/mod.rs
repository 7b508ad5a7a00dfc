//! Networks, run by `rten` (pure Rust) or, on request, by ONNX Runtime.

mod boxes;
mod crop;
mod crop_options;
mod crop_outputs;
mod detector_options;
mod engine;
mod keypoints;
mod nms;
mod onnx_bounds;
mod onnx_constants;
mod onnx_graph;
#[cfg(feature = "ort")]
mod onnx_runtime;
mod options;
mod preprocess;
mod rten_engine;
mod scene;
mod segmentation;

pub use boxes::BoxDetector;
pub use crop_options::CropOptions;
pub use detector_options::{AdvancedDetectorOptions, DetectorOptions};
pub use engine::Network;
pub use keypoints::KeypointNetwork;
pub use nms::{SuppressionOptions, suppress};
pub use options::{Engine, ModelOptions};
pub use scene::SceneNetwork;
pub use segmentation::RoadNetwork;
