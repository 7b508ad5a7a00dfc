//! Image files to pixels, strict about truncation.

use std::path::Path;

use image::{DynamicImage, GrayImage, ImageFormat};

use crate::error::{Error, Result};
use crate::frame::Pixels;
use crate::regular_file;

/// Reads a PNG or JPEG file; the content decides, not the ending.
pub(crate) fn read(path: &Path) -> Result<Pixels> {
    Ok(match read_dynamic(path)? {
        DynamicImage::ImageLuma8(image) => Pixels::Gray(image),
        image @ (DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)) => Pixels::Gray(image.into_luma8()),
        image => Pixels::Rgb(image.into_rgb8()),
    })
}

/// Reads a mask: nonzero stays nonzero.
pub(crate) fn read_mask(path: &Path) -> Result<GrayImage> {
    Ok(match read_dynamic(path)? {
        DynamicImage::ImageLuma8(image) => image,
        image => {
            // Grey by weights could round a dim colour to zero.
            let rgb = image.into_rgb8();
            let mut mask = GrayImage::new(rgb.width(), rgb.height());
            for (to, from) in mask.pixels_mut().zip(rgb.pixels()) {
                to.0 = [from.0.into_iter().max().unwrap_or(0)];
            }
            mask
        }
    })
}

fn read_dynamic(path: &Path) -> Result<DynamicImage> {
    let bytes = regular_file::read(path).map_err(Error::io(path))?;
    if bytes.is_empty() {
        return Err(Error::input(path, "is empty"));
    }
    let format = image::guess_format(&bytes).map_err(|_| Error::input(path, "is neither PNG nor JPEG"))?;
    if format == ImageFormat::Jpeg && !ends_like_jpeg(&bytes) {
        return Err(Error::input(path, "JPEG is truncated (no end marker)"));
    }
    image::load_from_memory_with_format(&bytes, format)
        .map_err(|e| Error::input(path, format!("cannot be decoded, it may be truncated: {e}")))
}

/// The decoder silently fills missing data with grey, so the end marker is checked here. Some cameras
/// pad files, hence not only the last two bytes.
fn ends_like_jpeg(bytes: &[u8]) -> bool {
    let tail = &bytes[bytes.len().saturating_sub(512)..];
    tail.windows(2).any(|pair| pair == [0xff, 0xd9])
}
