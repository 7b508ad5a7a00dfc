//! Loop closing: camera–camera edges between visits of a place, and the correction of the trajectory by them.

mod close;
mod edge;
mod loosen;
mod options;
mod report;
mod segments;
mod solve;
mod steps;
#[cfg(test)]
mod tests;
mod write;

pub use close::close_loops;
pub use edge::{LoopEdge, MapEdge, PlaceEdges};
pub use options::{AdvancedLoopOptions, LoopOptions};
pub use report::LoopReport;
pub use solve::LoopSolve;
