//! The road plane: alignment of grey values, tracking from frame to frame, measurements of scale and tilt.

mod alignment;
mod closed_form;
mod height;
mod history;
mod measurement;
mod normal_equations;
mod options;
mod pixels;
mod plane;
mod profile;
mod state;
mod tracker;
mod view;
mod watch;

pub use alignment::align_road;
pub use closed_form::{ClosedFormScale, ClosedFormState};
pub use height::{HeightOptions, MirrorOptions};
pub use measurement::{RoadCurvature, RoadEstimate, RoadMeasurement};
pub use options::{
    AdvancedClosedFormOptions, AdvancedRoadOptions, AlignmentOptions, ClosedFormOptions,
    PlaneTrackingOptions, ProfileOptions, RoadOptions, ScaleAverage,
};
pub use pixels::RoadPixels;
pub use plane::{AlignedRoad, road_normal, road_tilt};
pub use state::RoadState;
pub use tracker::{MirroredFrames, RoadInput, RoadTracker, RoadTrackerState};
pub use view::{RoadScratch, RoadView};
