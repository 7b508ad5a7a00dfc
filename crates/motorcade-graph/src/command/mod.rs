//! What the commands `graph optimise`, `graph info` and `graph compare` do, without a command line.
//!
//! Requests are plain structs, answers can be serialised; nothing is printed here.

mod compare;
mod info;
mod optimise;
mod robust;
mod starts;

pub use compare::{CompareReport, Differences, compare};
pub use info::{ComponentInfo, InfoReport, info};
pub use optimise::{OptimiseReport, OptimiseRequest, optimise};
pub use robust::RobustKernel;
pub use starts::Start;
