//! The state of a run on disk.

mod file;
mod folder;
pub(crate) mod grey_image;

pub use file::StateWriter;
pub use folder::StateFolder;
