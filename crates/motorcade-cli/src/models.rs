//! `motorcade models`, and the meaning of `--models`.

use std::path::Path;

use motorcade_perception::{ModelSource, list_models};

use crate::arguments::ModelsArguments;
use crate::exit;

/// `--models`: a folder, `none`, or the networks inside the program.
pub fn source(models: Option<&Path>) -> ModelSource {
    match models {
        Some(path) if path.as_os_str() == "none" => ModelSource::None,
        Some(path) => ModelSource::Folder(path.to_path_buf()),
        None => ModelSource::Embedded,
    }
}

/// Prints a line a network: name, kind, licence, kilobytes, hash.
pub fn models(arguments: &ModelsArguments) -> anyhow::Result<u8> {
    let models = list_models(&source(arguments.models.as_deref()))?;
    if models.is_empty() {
        exit::print("no networks")?;
    }
    for model in models {
        let kilobytes = model.bytes.div_ceil(1024);
        let line = format!(
            "{:<24} {:<13} {:<18} {kilobytes:>6} kB  {}",
            model.name, model.kind, model.licence, model.sha256
        );
        exit::print(&line)?;
    }
    Ok(exit::FINE)
}
