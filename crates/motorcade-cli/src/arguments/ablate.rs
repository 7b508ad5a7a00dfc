//! Arguments of `motorcade ablate`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::RunArguments;

/// Part of the method that is varied.
#[derive(Debug, Subcommand)]
#[command(
    after_help = "Example:\n  motorcade ablate odometry kitti/training --sequence 0005 --camera 3 \\\n      --kitti kitti/training --out tables/0005"
)]
pub enum AblateCommand {
    /// Camera: ways to metric scale, masks, smoothing.
    Odometry(Box<AblateArguments>),
    /// Vehicles: edges of the graph, weights, kernels, motion model.
    Graph(Box<AblateArguments>),
}

/// As `motorcade run`, with ground truth. `--out` receives ablation.md and ablation.csv.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade ablate odometry kitti/training --sequence 0005 --camera 3 --kitti kitti/training --out tables/0005
  motorcade ablate odometry kitti/odometry/00 --calibration camera.toml --ground-truth poses.txt --out tables/00
  motorcade ablate graph kitti/training --sequence 0003 --frames 10..133 --trajectory ego.txt --trajectory-scale metric \\
      --detections kitti/training/label_02/0003.txt --vehicle-poses poses/3_*.csv --kitti kitti/training --out tables/0003")]
pub struct AblateArguments {
    /// The run that is varied.
    #[command(flatten)]
    pub run: RunArguments,
    /// KITTI tracking split with the ground truth: calib/, gt_poses/, label_02/.
    #[arg(long, value_name = "ROOT", required_unless_present = "ground_truth")]
    pub kitti: Option<PathBuf>,
    /// Ground truth of the camera alone (KITTI or TUM poses of the processed camera, a row a frame of the run or of the input).
    #[arg(long, value_name = "FILE", conflicts_with = "kitti")]
    pub ground_truth: Option<PathBuf>,
}
