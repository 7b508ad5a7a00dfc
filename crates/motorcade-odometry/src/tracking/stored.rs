//! Pyramids as the pixels that they were built from: the rest follows with the same bits.

use std::sync::Arc;

use image::GrayImage;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::pyramid::Pyramid;

/// The finest level, and how many there are.
#[derive(Serialize, Deserialize)]
struct Stored {
    levels: usize,
    width: u32,
    height: u32,
    grey: Vec<u8>,
}

/// Writes a pyramid.
pub(crate) fn serialize<S: Serializer>(pyramid: &Arc<Pyramid>, serializer: S) -> Result<S::Ok, S::Error> {
    let finest = pyramid.level(0);
    // The values came from bytes.
    let grey = finest.data.iter().map(|v| *v as u8).collect();
    let (width, height) = (finest.width() as u32, finest.height() as u32);
    Stored { levels: pyramid.len(), width, height, grey }.serialize(serializer)
}

/// Reads a pyramid and builds its coarser levels.
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<Pyramid>, D::Error> {
    let Stored { levels, width, height, grey } = Stored::deserialize(deserializer)?;
    let image = GrayImage::from_raw(width, height, grey);
    let image = image.ok_or_else(|| D::Error::custom("a picture with too few pixels"))?;
    Ok(Arc::new(Pyramid::new(&image, levels)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize, Deserialize)]
    struct Holder(#[serde(with = "super")] Arc<Pyramid>);

    #[test]
    fn a_pyramid_comes_back_with_its_bits() {
        let image =
            GrayImage::from_fn(140, 70, |x, y| image::Luma([((x * x + 7 * y * (x + 3)) % 251) as u8]));
        let one = Arc::new(Pyramid::new(&image, 4));
        let text = serde_json::to_string(&Holder(one.clone())).unwrap();
        let Holder(two) = serde_json::from_str(&text).unwrap();
        assert_eq!((one.len(), one.contrast().to_bits()), (two.len(), two.contrast().to_bits()));
        for level in 0..one.len() {
            let bits = |p: &Pyramid| p.level(level).data.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&one), bits(&two), "{level}");
        }
        assert!(serde_json::from_str::<Holder>(&text.replace("\"width\":140", "\"width\":141")).is_err());
    }
}
