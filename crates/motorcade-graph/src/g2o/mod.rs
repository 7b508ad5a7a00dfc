//! `.g2o` files.
//!
//! Understood: `VERTEX_SE3:QUAT`, `EDGE_SE3:QUAT`, `VERTEX_SE2`, `EDGE_SE2`, `FIX` and comments. Other tags are
//! counted, reported and kept out. g2o orders tangents translation first: information matrices are permuted here
//! and nowhere else. Its SE(3) information belongs to the residual `[t, q_xyz]` for `mqt` and to `[ρ, φ]` for `log`;
//! both are read unchanged, so the two costs of one file differ (by about 4 in the rotation part).

mod convert;
mod read;
mod write;

pub use read::{Document, ReadOptions, ReadSummary, parse, read};
pub use write::{to_string, write};
