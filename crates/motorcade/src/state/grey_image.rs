//! Grey pictures as size and bytes, for serde.

use image::GrayImage;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Width, height and bytes.
type Parts<B> = (u32, u32, B);

pub(crate) fn serialize<S: Serializer>(image: &Option<GrayImage>, serializer: S) -> Result<S::Ok, S::Error> {
    let parts =
        image.as_ref().map(|image| -> Parts<&[u8]> { (image.width(), image.height(), image.as_raw()) });
    parts.serialize(serializer)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<GrayImage>, D::Error> {
    let Some((width, height, bytes)) = Option::<Parts<Vec<u8>>>::deserialize(deserializer)? else {
        return Ok(None);
    };
    let image = GrayImage::from_raw(width, height, bytes);
    image.map(Some).ok_or_else(|| D::Error::custom("a picture with too few pixels"))
}
