//! Synthetic drives.

mod drive;
mod error;
mod hash;
mod motion;
mod output;
mod plan;
mod render;
mod route;
mod scenario;
mod scenery;
mod simulate;
mod site;
mod vehicle;

pub use drive::Drive;
pub use error::{Error, Result};
pub use motion::{Bend, Grade, Road, RoadPlan, RoadPoint, SpeedPlan};
pub use output::{DetectorOptions, WriteOptions, Written};
pub use plan::{Driver, Plan, Rig, Route, Side};
pub use render::{Picture, RenderOptions, Renderer, SensorOptions, VehicleView};
pub use scenario::{Scenario, scenarios};
pub use simulate::simulate;
pub use site::Site;
pub use vehicle::SimulatedVehicle;
