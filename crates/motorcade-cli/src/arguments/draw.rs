//! Arguments of `motorcade draw`.

use std::path::PathBuf;

use clap::Args;
use motorcade_dataset::FrameRange;

use super::{McapSchemas, ProgressKind};

/// `motorcade draw`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade draw runs/drive --out overlay.mp4
  motorcade draw runs/0005 /new/place/kitti/training --out overlay.mp4 --frames 100..200
  motorcade draw runs/drive --out pictures
  motorcade draw runs/drive --out drive.mcap
  motorcade draw runs/drive --out ros.mcap --mcap-schemas ros2

Drawn are: every vehicle as a cuboid, its front filled, with identity, class, speed and distance ahead along the road; the last
3 s of moving vehicles; a grid on the road, 5 m by 1.75 m; the map from above, 60 m ahead; the camera's speed. Solid: moving.
Dashed: parked. Faint: not seen in this frame. Colours are those of report.html. Outlines grow with the standard deviation of the
position; ± is one standard deviation, ellipses are two.")]
pub struct DrawArguments {
    /// Directory of a run.
    pub run: PathBuf,
    /// Input of that run, where it is in another place now; by default as its run.json says, relative paths from here.
    pub input: Option<PathBuf>,
    /// Video (.mp4, .m4v, .mov, .mkv, .avi; written by ffmpeg), a recording for Foxglove and rerun (.mcap), or a folder of PNG
    /// pictures.
    #[arg(long)]
    pub out: PathBuf,
    /// Messages of a recording: Foxglove's for Foxglove and rerun, or those of ROS 2.
    #[arg(long, value_enum, default_value_t)]
    pub mcap_schemas: McapSchemas,
    /// Frames to draw, by the input's own numbers: A..B (B not included), A.., ..B.
    #[arg(long, default_value = "..")]
    pub frames: FrameRange,
    /// Calibration of that run, where it is in another place now.
    #[arg(long)]
    pub calibration: Option<PathBuf>,
    /// Threads; the drawing does not depend on it. 0 takes all cores.
    #[arg(long, default_value_t = 0, value_parser = super::parse_threads)]
    pub threads: usize,
    /// Form of the progress on stderr.
    #[arg(long, value_enum, default_value_t)]
    pub progress: ProgressKind,
    /// Replace an earlier video, or a folder of pictures whose overlay.json lists all of it.
    #[arg(long)]
    pub force: bool,
}
