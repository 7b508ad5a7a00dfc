//! Settings of a run.

use std::path::PathBuf;

use motorcade::{Config, Preset};
use motorcade_dataset::regular_file;
use pyo3::prelude::*;

use crate::errors::Failure;

/// Settings as the package hands them over, in the order in which they count.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SettingsArguments {
    /// Name of the preset.
    preset: String,
    /// Configuration file.
    config: Option<PathBuf>,
    /// Estimates of every frame as it came.
    online: bool,
    /// Seed of all random choices.
    seed: Option<u64>,
    /// Single settings by stage and key, as JSON.
    settings: String,
}

impl SettingsArguments {
    /// Preset, file and single settings, in that order.
    ///
    /// # Errors
    /// An unknown preset, a file that does not read, an unknown setting, a value out of its range.
    pub fn config(&self) -> Result<Config, Failure> {
        let preset = match self.preset.as_str() {
            "default" => Preset::Default,
            "paper" => Preset::Paper,
            other => {
                return Err(Failure::settings(format!("unknown preset `{other}`; one of default, paper")));
            }
        };
        let mut config = Config::preset(preset);
        if let Some(path) = &self.config {
            let text = regular_file::read_to_string(path)
                .map_err(|source| motorcade_dataset::Error::Io { path: path.clone(), source })?;
            config = config.overlay(&text, &path.display().to_string())?;
        }
        config.online.enabled |= self.online;
        if let Some(seed) = self.seed {
            config.run.seed = seed;
        }
        Ok(config.overlay(&self.settings, "settings")?)
    }
}

/// All settings as commented TOML.
#[pyfunction]
pub fn settings_text(settings: SettingsArguments) -> Result<String, Failure> {
    Ok(settings.config()?.to_commented_toml())
}
