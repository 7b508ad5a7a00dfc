//! Starting values for pose graphs that come without good ones.

mod choice;
mod chordal;
mod edges;
mod spanning_tree;

pub use choice::{MANY_ITERATIONS, Start, descend, prepare};
pub use chordal::chordal;
pub use spanning_tree::spanning_tree;
