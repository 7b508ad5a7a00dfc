//! Monocular multi-body SLAM on driving video: one camera in, metric trajectories of the camera and of every vehicle out.
//!
//! Three types to know: [`Motorcade`] takes frames one by one and returns an [`Estimate`] of each; [`Config`] holds all
//! settings; [`RunResult`] is the drive as a whole, which [`write_run`] puts into a directory of files others can read. The flow
//! is one direction: frames → perception → odometry → road and scale → vehicles → multi-object graph → outputs; every
//! stage only sees what came before it.
//!
//! ```no_run
//! use motorcade::Motorcade;
//! use motorcade::dataset::{Sequence, SequenceOptions};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let options = SequenceOptions { calibration: Some("camera.toml".into()), ..Default::default() };
//! let sequence = Sequence::open("drive.mp4".as_ref(), &options)?;
//! let mut slam = Motorcade::builder(sequence.camera()?).height_m(1.4).build()?;
//! for frame in sequence.frames() {
//!     let now = slam.step(&frame?)?;
//!     println!("{:6.1} m/s, {} vehicles", now.speed_mps, now.vehicles.len());
//! }
//! println!("{:.1} m driven", slam.finish().ego.length_m());
//! # Ok(())
//! # }
//! ```

mod archive;
mod assembly;
mod calibration;
mod check_options;
#[cfg(test)]
mod circle;
mod clock_jumps;
mod closed_loop;
mod config;
mod config_text;
mod content_clock;
mod detection_faults;
mod distances;
mod error;
mod estimate;
mod estimator;
mod estimator_options;
mod external;
mod external_files;
mod finite;
mod fixed_parts;
mod focal_by_turns;
mod frame_list;
mod front_end;
mod kept_map;
mod map_merge;
mod motion_source;
mod motorcade;
pub mod output;
mod output_options;
mod path_ahead;
mod picture_faults;
mod place_recorder;
mod plausibility;
mod progress;
mod record;
mod recorded;
mod relative;
mod repeated_frames;
mod result;
mod revision;
mod run;
mod scale_source;
mod setting_names;
mod settings;
mod speeds;
mod state;
mod swapped_frames;
#[cfg(test)]
mod test_results;
mod timing;

pub use calibration::{CameraCalibration, FocalPrior, Mounting, PriorOrigin, calibrate};
pub use check_options::{
    AdvancedCheckOptions, CheckOptions, ClockJumpOptions, DetectionFaultOptions, PlausibilityOptions,
    RepeatedFrameOptions, SwappedFrameOptions,
};
pub use closed_loop::{ClosedLoop, Loops};
pub use config::{AdvancedScaleOptions, Config, Preset, RunOptions, ScaleOptions, VehicleMask};
pub use distances::{DistanceSensor, Distances};
pub use error::{Error, Result};
pub use estimate::{Estimate, VehicleEstimate};
pub use estimator::{SlidingEstimator, estimate_drive};
pub use estimator_options::{
    AdvancedDistanceOptions, AdvancedOnlineOptions, AdvancedVehicleHeightOptions, DistanceOptions,
    OnlineOptions, UnitOptions, VehicleHeightOptions,
};
pub use external::External;
pub use external_files::ExternalFiles;
pub use focal_by_turns::FocalByTurns;
pub use kept_map::{KeptMap, MapMatch, MapUse};
pub use map_merge::{MergedMap, merge_maps};
pub use motion_source::ExternalTrajectory;
pub use motorcade::{Motorcade, MotorcadeBuilder};
pub use motorcade_calibrate::{CalibrateOptions, FocalCheckOptions, LensEstimate, ViewPrior};
pub use motorcade_dataset::{ExternalVehiclePose, read_vehicle_poses};
pub use motorcade_multibody as multibody;
pub use motorcade_multibody::{CameraCoupling, GraphKernel, GraphOptions, LoopEdge, LoopOptions, MapEdge};
pub use motorcade_odometry::ScaleAverage;
pub use motorcade_perception::KeypointTable;
pub use motorcade_places::{MapSummary, PlaceMap, PlaceOptions};
pub use motorcade_vehicles::{
    Source, TrackerOptions, TrafficSide, VehicleOptions, VehicleState, VehicleTrajectory,
};
pub use output::{RunContext, write_run, write_run_and};
pub use output_options::{AdvancedOutputOptions, OutputOptions};
pub use picture_faults::PictureFaultOptions;
pub use progress::{NoProgress, Progress};
pub use record::{FrameInfo, FrontEndRecord, FrontEndView};
pub use recorded::{
    RecordedCounters, RecordedFrame, RecordedInput, RecordedRun, RecordedState, RecordedVehicle, RunRecord,
};
pub use relative::relative_sigma_m;
pub use repeated_frames::{RepeatedPictures, repeated_pictures};
pub use result::RunResult;
pub use revision::{RevisedKeyframe, Revision};
pub use run::{FrameCallback, push_sequence, survey_sequence};
pub use settings::Settings;
pub use speeds::{Estimated, FrameSpeeds, VehicleAhead, speeds};
pub use state::{StateFolder, StateWriter};
pub use timing::{StageTime, Stopwatch};

// The crates whose types stand in this one's interface.
pub use motorcade_dataset as dataset;
pub use motorcade_geometry as geometry;
pub use motorcade_perception as perception;

/// The README's snippet compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
