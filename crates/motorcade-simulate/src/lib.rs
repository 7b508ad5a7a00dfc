//! Synthetic drives with exact ground truth, from traffic on a road down to the pixels of a camera.
//!
//! Three types to know: a [`Scenario`] is a plan with a name, [`simulate`] turns it into a [`Drive`] (poses of the camera
//! and of every vehicle at every frame), and a [`Renderer`] makes a [`Picture`] of any frame. The flow is one
//! direction: plan → road and kinematic bicycles → drive → scenery and meshes → pictures → labels, detections, files.
//! [`Drive::write_kitti`] writes a folder in the shape of KITTI tracking; [`reenact`] makes a drive from a real
//! trajectory and its labels.
//!
//! All random numbers come from the seed: the same seed gives the same bytes, for any number of threads.
//! Textures are fixed to the world and filtered to the pixel's footprint, so nothing crawls or pops.
//!
//! ```
//! use motorcade_dataset::{Sequence, SequenceOptions};
//! use motorcade_simulate::{RenderOptions, Scenario, WriteOptions, simulate};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scenario = Scenario::by_name("demo").ok_or("no such scenario")?;
//! let drive = simulate(&scenario, 2, 7, &RenderOptions::default().with_width(160))?;
//! assert!((drive.length_m() - 0.8).abs() < 0.1); // a tenth of a second at 8 m/s
//!
//! let folder = tempfile::tempdir()?;
//! let written = drive.write_kitti(folder.path(), &WriteOptions::default(), &|_frames_done| {})?;
//! let sequence = Sequence::open(&written.training, &SequenceOptions::default())?;
//! assert_eq!((sequence.len(), sequence.size().0), (2, 160));
//! # Ok(())
//! # }
//! ```

mod drive;
mod error;
mod form;
mod hash;
mod measure;
mod mesh;
mod motion;
mod options;
mod output;
mod plan;
mod reenact;
mod render;
mod route;
mod scenario;
mod scenery;
mod simulate;
mod site;
mod trailer;
mod training;
mod vehicle;
mod visit;
mod weather;

pub use drive::Drive;
pub use error::{Error, Result};
pub use measure::{
    KeypointMeasurement, KeypointOptions, MeasureOptions, Measurements, PointObservation, RoadMatch,
};
pub use motion::{Bend, Grade, Paved, Road, RoadKind, RoadPlan, RoadPoint, SpeedPlan};
pub use options::{DetectorOptions, Look, RenderOptions, SensorOptions};
pub use output::{DRIVE_RECORD, WriteOptions, Written};
pub use plan::{Driver, Plan, Rig, Route, Side, Staging, Twins};
pub use reenact::{ReenactOptions, labels_in_camera, reenact};
pub use render::{Picture, Renderer, VehicleView};
pub use scenario::{Scenario, scenarios};
pub use simulate::{simulate, simulate_again};
pub use site::Site;
pub use trailer::TrailerKind;
pub use training::{VehicleCropOptions, write_vehicle_crops, write_vehicle_crops_until};
pub use vehicle::{Body, SimulatedVehicle};
pub use weather::Weather;
