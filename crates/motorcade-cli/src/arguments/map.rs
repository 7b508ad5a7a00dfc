//! Arguments of `motorcade map`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use motorcade_map::Anchor;

/// `motorcade map`.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  motorcade run drive.mp4 --calibration camera.toml --height 1.4 --out runs/drive --save-map drive.map
  motorcade map info drive.map
  motorcade map export drive.map --out landmarks.ply
  motorcade map export drive.map --out way.geojson --start 49.0112,8.4228,270
  motorcade map merge monday.map tuesday.map --out streets.map")]
pub enum MapCommand {
    /// Keyframes, landmarks, size.
    Info(MapInfoArguments),
    /// Landmarks and cameras as a PLY file, or the way as GeoJSON.
    Export(MapExportArguments),
    /// Two maps that share places as one, in the world of the first; maps that do not meet are refused.
    Merge(MapMergeArguments),
}

/// `motorcade map merge`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  motorcade map merge monday.map tuesday.map --out streets.map")]
pub struct MapMergeArguments {
    /// File of `run --save-map`, in whose world the merged map is.
    pub first: PathBuf,
    /// File of `run --save-map` that is joined to it.
    pub second: PathBuf,
    /// The merged map.
    #[arg(long)]
    pub out: PathBuf,
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
#[command(after_help = "Examples:
  motorcade map export drive.map --out landmarks.ply
  motorcade map export drive.map --out way.geojson --start 49.0112,8.4228,270")]
pub struct MapExportArguments {
    /// File of `run --save-map`.
    pub map: PathBuf,
    /// A file .ply with x, y, z in metres in the world of the drive, cameras orange, landmarks grey; or .geojson with the way on the earth.
    #[arg(long)]
    pub out: PathBuf,
    /// Place of the first camera and the direction it looks in, clockwise from north: LATITUDE,LONGITUDE,HEADING[,ALTITUDE] in
    /// degrees and metres; for GeoJSON.
    #[arg(long, value_name = "LAT,LON,HEADING", allow_hyphen_values = true)]
    pub start: Option<Anchor>,
}
