//! Starting values for pose graphs that come without good ones.

mod chordal;
mod edges;
mod spanning_tree;

pub use chordal::chordal;
pub use spanning_tree::spanning_tree;
