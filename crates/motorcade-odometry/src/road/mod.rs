//! The road plane: alignment of grey values, tracking from frame to frame, measurements of scale and tilt.

mod alignment;
mod closed_form;
mod measurement;
mod pixels;
mod profile;
mod tracker;

pub use alignment::{RoadOptions, RoadPlane, RoadScratch, RoadView, align_road};
pub use closed_form::{ClosedFormScale, ScaleAverage};
pub use measurement::{Reading, RoadCurvature, RoadMeasurement, road_normal};
pub use pixels::RoadPixels;
pub use tracker::{RoadInput, RoadTracker};
