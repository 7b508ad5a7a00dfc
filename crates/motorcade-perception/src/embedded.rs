//! The networks inside the binary: those of the repository's folder `models/`.

use crate::error::Result;
use crate::models::{ModelOptions, ModelSet};

#[cfg(feature = "networks")]
mod files {
    pub(super) const MANIFEST: &str = include_str!("../../../models/models.toml");
    pub(super) const FILES: [(&str, &[u8]); 2] = [
        ("scene.onnx", include_bytes!("../../../models/scene.onnx")),
        ("vehicle.onnx", include_bytes!("../../../models/vehicle.onnx")),
    ];
}

/// The networks inside the binary, for images of this size (width, height) \[px\]; none where they were left out.
#[cfg(feature = "networks")]
pub(crate) fn load(image_size: (u32, u32), options: &ModelOptions) -> Result<ModelSet> {
    use std::path::{Path, PathBuf};

    use crate::error::Error;
    use crate::manifest::Manifest;
    use crate::network::Network;

    let manifest = Manifest::parse(Path::new("embedded models.toml"), files::MANIFEST)?;
    ModelSet::build(&manifest, image_size, options, |entry, threads| {
        let file = files::FILES.iter().find(|(name, _)| *name == entry.file);
        let path = PathBuf::from(format!("embedded {}", entry.file));
        let (_, bytes) = file.ok_or_else(|| Error::model(&path, "is not inside the binary"))?;
        Network::from_bytes(path, bytes.to_vec(), entry, options, threads)
    })
}

/// Without the feature `networks` there are none.
#[cfg(not(feature = "networks"))]
pub(crate) fn load(_image_size: (u32, u32), _options: &ModelOptions) -> Result<ModelSet> {
    Ok(ModelSet::default())
}
