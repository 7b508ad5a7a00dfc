//! A trial of the networks of a folder.

use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

use image::RgbImage;
use motorcade_dataset::Frame;
use rten::ThreadPool;

use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
use crate::error::Result;
use crate::manifest::{Manifest, ModelEntry};
use crate::models::ModelSet;
use crate::network::ModelOptions;
use crate::network::Network;

/// Loads the networks of a folder and runs those that suit the size best on a black picture of it (width, height) \[px\];
/// `each` is called with the file before a network is loaded and before it runs. A network can end the process by asking for
/// more memory than there is: a program that is to survive that makes the trial in a second one.
///
/// # Errors
/// As [`ModelSet::load`], and a network that does not run.
pub fn try_models(
    folder: &Path,
    image_size: (u32, u32),
    options: &ModelOptions,
    each: &mut dyn FnMut(&Path),
) -> Result<()> {
    let frame = Frame::from_rgb(RgbImage::new(image_size.0, image_size.1), 0);
    let (right, below) = (f64::from(image_size.0) - 1.0, f64::from(image_size.1) - 1.0);
    let whole = Detection {
        class: VehicleClass::Car,
        score: 1.0,
        bbox: BoundingBox::new([0.0, 0.0, right, below]),
        convention: BoxConvention::VisibleExtent,
        external_id: None,
        pixel_size: 1.0,
        road_below: None,
    };
    let manifest = Manifest::of_folder(folder)?;
    let each = RefCell::new(each);
    let report = |entry: &ModelEntry| (each.borrow_mut())(&folder.join(&entry.file));
    let load = |entry: &ModelEntry, threads: &Arc<ThreadPool>| {
        report(entry);
        Network::load(folder, entry, options, threads)
    };
    let mut set = ModelSet::build(&manifest, image_size, options, load)?;
    let report_chosen = |description: String| {
        manifest.models.iter().filter(|entry| description.ends_with(&entry.name)).for_each(report);
    };
    if let Some(detector) = &mut set.vehicles {
        report_chosen(detector.description());
        detector.detect(&frame)?;
    }
    if let Some(segmenter) = &mut set.road {
        report_chosen(segmenter.description());
        segmenter.segment(&frame)?;
    }
    if let Some(detector) = &mut set.keypoints {
        report_chosen(detector.description());
        detector.keypoints(&frame, std::slice::from_ref(&whole))?;
    }
    Ok(())
}
