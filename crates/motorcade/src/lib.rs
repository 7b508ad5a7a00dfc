//! Monocular multi-body SLAM on driving video: one camera in, metric trajectories of the camera and of every vehicle out.
//!
//! Three types to know: [`Config`] holds all settings, [`run`] takes a sequence and gives a [`RunResult`], and
//! [`write_run`] puts it into a directory of files others can read. The flow is one direction: frames → perception →
//! odometry → road and scale → vehicles → outputs; every stage only sees what came before it.
//!
//! ```no_run
//! use motorcade::{Config, NoProgress, run, write_run};
//! use motorcade_dataset::{Sequence, SequenceOptions};
//! use motorcade_perception::Perception;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let options = SequenceOptions { calibration: Some("camera.toml".into()), ..Default::default() };
//! let sequence = Sequence::open("drive.mp4".as_ref(), &options)?;
//! let height_m = sequence.height_m(Some(1.4))?;
//! let given = motorcade::External::default();
//! let result = run(&sequence, &Perception::none(), &given, height_m, &Config::default(), 1, &NoProgress)?;
//! println!("{:.1} m driven", result.ego.length_m());
//! # Ok(())
//! # }
//! ```

mod config;
mod error;
mod front_end;
mod given_vehicles;
mod keypoints;
mod motion_source;
mod online;
pub mod output;
mod pipeline;
mod progress;
mod result;
mod scale_source;
mod standing_unit;
mod timing;

pub use config::{Config, Preset, RunOptions, ScaleOptions, VehicleMask, VehicleOptions};
pub use error::{Error, Result};
pub use front_end::{FramelessInput, FrontEnd, FrontEndView, Watch};
pub use given_vehicles::{ExternalVehiclePose, read_vehicle_poses};
pub use keypoints::KeypointTable;
pub use motion_source::ExternalTrajectory;
pub use motorcade_multibody as multibody;
pub use motorcade_multibody::{CameraCoupling, GraphKernel, GraphOptions};
pub use online::{Online, OnlineEstimate, OnlineOptions};
pub use output::{RunContext, write_run};
pub use pipeline::{External, estimate_drive, run};
pub use progress::{NoProgress, Progress};
pub use result::{FrameInfo, RunResult};
pub use timing::{StageTime, Stopwatch};
