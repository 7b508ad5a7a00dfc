//! The networks inside the binary: those of the repository's folder `models/`.

#[cfg(feature = "networks")]
use std::path::Path;

#[cfg(feature = "networks")]
use crate::error::Error;
use crate::error::Result;
#[cfg(feature = "networks")]
use crate::manifest::Manifest;
use crate::manifest::ModelEntry;

#[cfg(feature = "networks")]
mod files {
    pub(super) const MANIFEST: &str = include_str!("../../../models/models.toml");
    pub(super) const FILES: [(&str, &[u8]); 2] = [
        ("scene.onnx", include_bytes!("../../../models/scene.onnx")),
        ("vehicle.onnx", include_bytes!("../../../models/vehicle.onnx")),
    ];
}

/// Manifest entries and files of the networks inside the binary; none where they were left out.
#[cfg(feature = "networks")]
pub(crate) fn entries() -> Result<Vec<(ModelEntry, &'static [u8])>> {
    let manifest = Manifest::parse(Path::new("embedded models.toml"), files::MANIFEST)?;
    let file_of = |entry: ModelEntry| {
        let file = files::FILES.iter().find(|(name, _)| *name == entry.file);
        let missing = || Error::model(Path::new(&entry.file), "is not inside the binary");
        let bytes = file.ok_or_else(missing)?.1;
        Ok((entry, bytes))
    };
    manifest.models.into_iter().map(file_of).collect()
}

/// Without the feature `networks` there are none.
#[cfg(not(feature = "networks"))]
pub(crate) fn entries() -> Result<Vec<(ModelEntry, &'static [u8])>> {
    Ok(Vec::new())
}
