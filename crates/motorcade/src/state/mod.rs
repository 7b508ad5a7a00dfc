//! The state of a run on disk.

mod folder;
pub(crate) mod grey_image;

pub use folder::StateFolder;
