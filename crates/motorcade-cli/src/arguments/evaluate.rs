//! Arguments of `motorcade evaluate`.

use std::path::PathBuf;

use clap::Args;

/// `motorcade evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade evaluate runs/0005 --kitti kitti/training --sequence 0005 --camera 3
  motorcade evaluate runs/0003 --kitti kitti/training --json runs/0003-errors.json")]
pub struct EvaluateArguments {
    /// Directory of a run, or any with ego.kitti.txt or ego.tum, and tracks.kitti.txt when it has vehicles.
    pub run: PathBuf,
    /// KITTI tracking split with calib/, gt_poses/ and label_02/ (label_03/ for camera 3).
    #[arg(long, value_name = "ROOT")]
    pub kitti: PathBuf,
    /// Sequence, such as 0005; by default that of the run's run.json.
    #[arg(long)]
    pub sequence: Option<String>,
    /// Camera the run was made from; by default that of the run's run.json, else 2.
    #[arg(long)]
    pub camera: Option<u8>,
    /// KITTI number of the run's first frame; by default that of the run's frames.csv or run.json, else 0.
    #[arg(long)]
    pub first: Option<u64>,
    /// Also write the errors as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}
