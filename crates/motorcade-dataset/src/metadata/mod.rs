//! Metadata of the camera in picture and video files.

mod container;
mod exif;
mod focal;

pub use focal::{FocalKind, FocalMetadata};

use std::path::Path;

use crate::source::{Slot, Store};

/// Relative difference of two focal lengths of one drive from which on the lens was zoomed.
const ZOOMED: f64 = 0.01;

/// Focal length by the metadata of a drive with pictures of this size: EXIF of the first and last picture, or the tags of the video.
/// `None` where nothing is stated, or not the same over the drive.
pub(crate) fn focal(store: &Store, slots: &[Slot], size: (u32, u32)) -> Option<FocalMetadata> {
    match store {
        Store::Video(path) => container::focal(path, size),
        Store::Files => {
            let mut paths = slots.iter().filter_map(|slot| slot.path.as_deref());
            let of = |path: Option<&Path>| path.and_then(|path| exif::focal(path, size));
            let first = of(paths.next())?;
            let last = of(paths.next_back()).unwrap_or(first);
            let ratio = (last.widths / first.widths).ln().abs();
            (ratio < ZOOMED && last.kind == first.kind).then_some(first)
        }
        Store::Live(_) => None,
    }
}
