//! A trial of every network of a folder.

use std::path::Path;

use image::RgbImage;
use motorcade_dataset::Frame;

use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
use crate::error::Result;
use crate::manifest::Manifest;
use crate::models::{ModelOptions, ModelSet};
use crate::network::Network;

/// Loads each network of a folder and runs it on a black picture of this size (width, height) \[px\]; `each` is called with
/// its file before. A network can end the process by asking for more memory than there is: a program that is to survive that
/// makes the trial in a second one.
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
    };
    for entry in Manifest::of_folder(folder)?.models {
        each(&folder.join(&entry.file));
        let one = Manifest { models: vec![entry] };
        let mut set = ModelSet::build(&one, image_size, options, |entry, threads| {
            Network::load(folder, entry, options, threads)
        })?;
        if let Some(detector) = &mut set.vehicles {
            detector.detect(&frame)?;
        }
        if let Some(segmenter) = &mut set.road {
            segmenter.segment(&frame)?;
        }
        if let Some(detector) = &mut set.keypoints {
            detector.keypoints(&frame, std::slice::from_ref(&whole))?;
        }
    }
    Ok(())
}
