//! Networks, run by `rten` (pure Rust).

mod engine;
mod nms;
mod preprocess;
mod segmentation;
mod yolox;

pub use engine::Network;
pub use nms::suppress;
pub use segmentation::RoadSegmenter;
pub use yolox::VehicleDetector;
