//! The networks of a source, for people: name, kind, licence, hash.

use std::path::Path;

use motorcade_dataset::regular_file;

use crate::digest::sha256;
use crate::embedded;
use crate::error::{Error, Result};
use crate::manifest::{Manifest, ModelEntry, OutputSpec};
use crate::models::ModelSource;

/// A network of a source.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ModelInfo {
    /// Name in reports.
    pub name: String,
    /// File.
    pub file: String,
    /// Kind of its output, as in `models.toml`.
    pub kind: &'static str,
    /// Licence of the weights.
    pub licence: String,
    /// SHA-256 of the file in hexadecimal.
    pub sha256: String,
    /// Size of the file \[bytes\].
    pub bytes: usize,
}

/// The networks of a source, in the order of its manifest.
///
/// # Errors
/// A folder without a usable manifest, a file that does not read.
pub fn list_models(source: &ModelSource) -> Result<Vec<ModelInfo>> {
    match source {
        ModelSource::None => Ok(Vec::new()),
        ModelSource::Embedded => {
            let entries = embedded::entries()?;
            Ok(entries.iter().map(|(entry, bytes)| info(entry, bytes)).collect())
        }
        ModelSource::Folder(folder) => {
            let manifest = Manifest::of_folder(folder)?;
            manifest.models.iter().map(|entry| Ok(info(entry, &read(folder, entry)?))).collect()
        }
    }
}

fn read(folder: &Path, entry: &ModelEntry) -> Result<Vec<u8>> {
    let path = folder.join(&entry.file);
    regular_file::read(&path).map_err(|e| Error::model(&path, format!("network does not read: {e}")))
}

fn info(entry: &ModelEntry, bytes: &[u8]) -> ModelInfo {
    let kind = match entry.output {
        OutputSpec::Yolox { .. } => "yolox",
        OutputSpec::Ssd { .. } => "ssd",
        OutputSpec::CentrePoint { .. } => "centre-point",
        OutputSpec::Segmentation { .. } => "segmentation",
        OutputSpec::Scene { .. } => "scene",
        OutputSpec::Keypoints { .. } => "keypoints",
    };
    ModelInfo {
        name: entry.name.clone(),
        file: entry.file.clone(),
        kind,
        licence: entry.licence.clone(),
        sha256: sha256(bytes),
        bytes: bytes.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_listed_with_hashes() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("net.onnx"), b"abc").unwrap();
        let manifest = "[[model]]\nname = \"net\"\nfile = \"net.onnx\"\nlicence = \"MIT\"\ninput = { colour = \"rgb\", resize = \"stretch\" }\noutput = { kind = \"scene\" }\n";
        std::fs::write(folder.path().join("models.toml"), manifest).unwrap();
        let models = list_models(&ModelSource::Folder(folder.path().to_path_buf())).unwrap();
        assert_eq!((models[0].kind, models[0].bytes), ("scene", 3));
        assert!(models[0].sha256.starts_with("ba7816bf"), "SHA-256 of abc");
    }
}
