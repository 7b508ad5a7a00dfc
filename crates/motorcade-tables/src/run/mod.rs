//! The tables of a run.

mod catalogue;
mod cells;
mod files;
mod minutes;
mod run_table;

pub use files::{RunFiles, frames, tracks};
pub use run_table::RunTable;

#[cfg(test)]
pub(crate) mod tests;
