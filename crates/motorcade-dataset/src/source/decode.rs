//! Image files to pixels, strict about truncation.

use std::io::Cursor;
use std::path::Path;

use image::metadata::Orientation;
use image::{DynamicImage, GrayImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use crate::error::{Error, Result};
use crate::frame::Pixels;
use crate::regular_file;

/// Endings of image files.
pub const IMAGE_ENDINGS: [&str; 7] = ["png", "jpg", "jpeg", "webp", "bmp", "tif", "tiff"];

/// Reads an image file; the content decides, not the ending.
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
    let format = image::guess_format(&bytes)
        .map_err(|_| Error::input(path, "is no image: neither PNG, JPEG, WebP, BMP nor TIFF"))?;
    if format == ImageFormat::Jpeg && !ends_like_jpeg(&bytes) {
        return Err(Error::input(path, "JPEG is truncated (no end marker)"));
    }
    let unreadable = |e| Error::input(path, format!("cannot be decoded, it may be truncated: {e}"));
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    let mut reader = ImageReader::with_format(Cursor::new(&bytes), format);
    reader.limits(limits.clone());
    let mut decoder = reader.into_decoder().map_err(unreadable)?;
    // A header of a few bytes may claim any size.
    limits.reserve(decoder.total_bytes()).map_err(unreadable)?;
    decoder.set_limits(limits).map_err(unreadable)?;
    // Cameras and phones note how they were held; pixels are those of the sensor, and so is a calibration.
    if let Ok(orientation) = decoder.orientation()
        && orientation != Orientation::NoTransforms
    {
        return Err(Error::input(
            path,
            format!(
                "is to be shown turned or mirrored (EXIF orientation {}); turn the pictures themselves and calibrate for them",
                orientation.to_exif()
            ),
        ));
    }
    DynamicImage::from_decoder(decoder).map_err(unreadable)
}

/// Most memory of a decoded image \[bytes\]: a larger one is none of a drive.
const MOST_BYTES: u64 = 512 << 20;

/// The decoder silently fills missing data with grey, so the end marker is checked here. Some cameras
/// pad files, hence not only the last two bytes.
fn ends_like_jpeg(bytes: &[u8]) -> bool {
    let tail = &bytes[bytes.len().saturating_sub(512)..];
    tail.windows(2).any(|pair| pair == [0xff, 0xd9])
}
