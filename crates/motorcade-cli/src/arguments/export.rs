//! Arguments of `motorcade export`.

use std::path::PathBuf;

use clap::Args;
use motorcade_dataset::ClockOffset;
use motorcade_map::Anchor;

/// `motorcade export`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade export runs/drive --out map --track drive.gpx
  motorcade export runs/drive --out map --start 49.0112,8.4228,270
  motorcade export runs/drive --out scenario

Files: drive.geojson, drive.gpx, drive.kml with the camera and every vehicle; ego.oxts.csv with the camera in the columns of KITTI's
oxts files; drive.xosc, an OpenSCENARIO 1.2 scenario for simulators. Without --start and --track drive.xosc alone is written, its x
axis along the road at the first frame. The metres are the run's own: a track gives the place, the heading and the clock.")]
pub struct ExportArguments {
    /// Directory of a run.
    pub run: PathBuf,
    /// Directory of the files, new or empty.
    #[arg(long)]
    pub out: PathBuf,
    /// Place of the first camera and the direction it looks in, clockwise from north: LATITUDE,LONGITUDE,HEADING[,ALTITUDE] in
    /// degrees and metres.
    #[arg(long, value_name = "LAT,LON,HEADING", allow_hyphen_values = true, conflicts_with = "track")]
    pub start: Option<Anchor>,
    /// GPS track of the drive: .gpx, .nmea, or .csv with columns time, latitude, longitude and optionally altitude, sigma_m.
    #[arg(long, value_name = "FILE")]
    pub track: Option<PathBuf>,
    /// Offset from the run's clock to that of the track in seconds, and its standard deviation (2 s by default). Without this option
    /// the offset is estimated from the track alone.
    #[arg(long, value_name = "SECONDS[,SIGMA]", requires = "track", allow_hyphen_values = true)]
    pub clock_offset: Option<ClockOffset>,
    /// Replace an earlier export in --out; only files that its export.json lists are removed.
    #[arg(long)]
    pub force: bool,
}
