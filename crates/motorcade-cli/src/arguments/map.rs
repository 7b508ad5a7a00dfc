//! Arguments of `motorcade map`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// `motorcade map`.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  motorcade run drive.mp4 --calibration camera.toml --height 1.4 --out runs/drive --save-map drive.map
  motorcade map info drive.map
  motorcade map export drive.map --out landmarks.ply")]
pub enum MapCommand {
    /// Keyframes, landmarks, size.
    Info(MapInfoArguments),
    /// Landmarks and cameras as a PLY file.
    Export(MapExportArguments),
}

/// `motorcade map info`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  motorcade map info drive.map")]
pub struct MapInfoArguments {
    /// File of `run --save-map`.
    pub map: PathBuf,
}

/// `motorcade map export`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  motorcade map export drive.map --out landmarks.ply")]
pub struct MapExportArguments {
    /// File of `run --save-map`.
    pub map: PathBuf,
    /// The PLY file: x, y, z in metres in the world of the drive; cameras orange, landmarks grey.
    #[arg(long)]
    pub out: PathBuf,
}
