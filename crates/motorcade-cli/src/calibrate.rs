//! `motorcade calibrate`, and `run --calibration auto`.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use motorcade::{CameraCalibration, Config, FocalPrior, Progress, ViewPrior, calibrate as by_drive};
use motorcade_dataset::{Sequence, SequenceOptions};
use motorcade_perception::{ModelOptions, Perception, PerceptionOptions};

use crate::arguments::CalibrateArguments;
use crate::exit::{self, Stopped};
use crate::files::{OutFile, all_different};
use crate::models;
use crate::progress::Reporter;

/// Estimates the camera of a drive and writes its file.
pub fn calibrate(arguments: &CalibrateArguments) -> anyhow::Result<u8> {
    if arguments.input.calibration.is_some() {
        let problem = "--calibration: calibrate finds the calibration; a field of view that is known is stated with --view-deg";
        anyhow::bail!(motorcade::Error::Config(problem.into()));
    }
    let config = arguments.set.iter().try_fold(Config::default(), |config, one| config.set(one))?;
    let mask = mask_beside(&arguments.out);
    let named =
        [("the input", &arguments.input.input), ("--out", &arguments.out), ("the mask beside --out", &mask)];
    all_different(named.map(|(option, path)| (option, path.as_path())))?;
    let (out, mask_file) = (place(&arguments.out, arguments.force)?, place(&mask, arguments.force)?);
    let options = SequenceOptions { uncalibrated: true, ..arguments.input.options() };
    let sequence = Sequence::open(&arguments.input.input, &options)?;
    let stated = arguments
        .view_deg
        .map(|(view, per_cent)| ViewPrior { view_rad: view.to_radians(), log_sigma: 0.01 * per_cent });
    let reporter = Reporter::new(arguments.progress);
    let found = of(&sequence, arguments.models.as_deref(), stated, &config, &reporter)?;
    reporter.finish();
    out.write(found.to_toml())?;
    for line in found.describe() {
        exit::say(&line);
    }
    exit::say(&arguments.out.display().to_string());
    if let Some(fixed) = &found.fixed {
        let mut png = Cursor::new(Vec::new());
        fixed.write_to(&mut png, image::ImageFormat::Png)?;
        mask_file.write(png.into_inner())?;
        exit::say(&mask.display().to_string());
    }
    Ok(exit::FINE)
}

/// The camera of a drive that was opened without a calibration. A stated view replaces what metadata state.
pub fn of(
    sequence: &Sequence,
    networks: Option<&Path>,
    stated: Option<ViewPrior>,
    config: &Config,
    reporter: &Reporter,
) -> anyhow::Result<CameraCalibration> {
    let inference = ModelOptions { detectors: config.perception, ..ModelOptions::default() };
    let options = PerceptionOptions {
        models: models::source(networks),
        without_keypoints: true,
        networks: inference,
        ..PerceptionOptions::default()
    };
    let prior = stated.map_or_else(|| FocalPrior::of(sequence, &config.calibration), FocalPrior::stated);
    let perception = Perception::open(&options, sequence.size())?;
    let most = config.calibration.most_frames;
    if sequence.len() > most {
        reporter.warn(&format!("the first {most} of {} frames are used for the calibration", sequence.len()));
    }
    let found = by_drive(sequence, perception, prior, &config.calibration, reporter)?;
    found.ok_or_else(|| Stopped("stopped before the camera was calibrated; nothing was written").into())
}

/// A file that does not replace another one unasked.
fn place(path: &Path, force: bool) -> Result<OutFile, motorcade::Error> {
    if path.exists() && !force {
        return Err(motorcade::Error::Config(format!(
            "{} is there already; --force replaces it",
            path.display()
        )));
    }
    OutFile::replace(path)
}

/// `camera.toml` → `camera-ignore.png`.
fn mask_beside(out: &Path) -> PathBuf {
    let mut name = out.file_stem().unwrap_or(out.as_os_str()).to_owned();
    name.push("-ignore.png");
    out.with_file_name(name)
}
