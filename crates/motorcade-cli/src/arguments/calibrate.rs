//! Arguments of `motorcade calibrate`.

use std::path::PathBuf;

use clap::Args;

use super::{InputArguments, ProgressKind};

/// `motorcade calibrate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade calibrate drive.mp4 --out camera.toml
  motorcade calibrate drive.mp4 --frames 600..1500 --out camera.toml
  motorcade calibrate drive.mp4 --view-deg 120,10 --out camera.toml
  motorcade run drive.mp4 --calibration camera.toml --height 1.4 --out runs/drive

The camera must move and turn: a few corners of streets are enough. Straight motion determines no focal length, and the program says so. A
calibration that the input has is left out. Where something is fixed to the camera (a bonnet), a mask for --ignore is written beside the file.")]
pub struct CalibrateArguments {
    /// The input.
    #[command(flatten)]
    pub input: InputArguments,
    /// The calibration file to write: TOML, with standard deviations.
    #[arg(long)]
    pub out: PathBuf,
    /// Horizontal field of view that is stated for the camera, in degrees, and the relative standard deviation of the focal length in per cent
    /// (10 without one). It replaces what EXIF or the tags of a video state.
    #[arg(long, value_name = "DEG[,PERCENT]", value_parser = parse_view)]
    pub view_deg: Option<(f64, f64)>,
    /// Folder of ONNX networks, or `none`; the networks inside the program by default. Vehicles that they find are left out.
    #[arg(long, env = "MOTORCADE_MODELS")]
    pub models: Option<PathBuf>,
    /// One setting, such as calibration.most_frames=3000; may be repeated.
    #[arg(long = "set", value_name = "STAGE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Form of the progress on stderr.
    #[arg(long, value_enum, default_value_t)]
    pub progress: ProgressKind,
    /// Replace a file that is there.
    #[arg(long)]
    pub force: bool,
}

fn parse_view(text: &str) -> Result<(f64, f64), String> {
    let (view, sigma) = text.split_once(',').unwrap_or((text, "10"));
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("{text:?} is not a number"));
    let (view, sigma) = (number(view)?, number(sigma)?);
    if !(10.0..=150.0).contains(&view) {
        return Err(format!("the field of view must lie in [10, 150] degrees, got {view}"));
    }
    if !(0.1..=100.0).contains(&sigma) {
        return Err(format!("its standard deviation must lie in [0.1, 100] per cent, got {sigma}"));
    }
    Ok((view, sigma))
}
