//! Pictures of the frames.

use std::io::Cursor;

use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;

use crate::error::Error;

/// Quality of the pictures.
const JPEG_QUALITY: u8 = 85;

/// A picture as JPEG.
pub(crate) fn jpeg(picture: &RgbImage) -> Result<Vec<u8>, Error> {
    let mut jpeg = Cursor::new(Vec::new());
    JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY).encode_image(picture)?;
    Ok(jpeg.into_inner())
}
