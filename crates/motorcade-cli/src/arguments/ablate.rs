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
    /// The paper: Tables 1 to 3 of Nair et al. 2020, with the baseline of relative scales.
    Paper(Box<AblateArguments>),
    /// Metres: road, points on it, sizes of vehicles and speed, each alone and together.
    Scale(Box<ScaleAblateArguments>),
    /// Vehicles: cues of their positions, each alone, left out and together; other networks.
    Vehicles(Box<VehiclesAblateArguments>),
}

/// As `motorcade run`, with what is known of the truth: the camera's trajectory, the length of its way, or nothing. `--speed` or `--gps`
/// adds that sensor as a source. `--out` receives ablation.md and ablation.csv.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade ablate scale kitti/training --sequence 0005 --camera 3 --speed speed.csv --kitti kitti/training --out tables/0005
  motorcade ablate scale drive.mp4 --calibration camera.toml --height 1.4 --distance 1250 --out tables/drive")]
pub struct ScaleAblateArguments {
    /// The run that is varied.
    #[command(flatten)]
    pub run: RunArguments,
    /// KITTI tracking split with the ground truth: calib/, gt_poses/, label_02/.
    #[arg(long, value_name = "ROOT", conflicts_with_all = ["ground_truth", "distance"])]
    pub kitti: Option<PathBuf>,
    /// Ground truth of the camera (KITTI or TUM poses of the processed camera, a row a frame of the run or of the input).
    #[arg(long, value_name = "FILE", conflicts_with = "distance")]
    pub ground_truth: Option<PathBuf>,
    /// Length of the whole way in metres, measured otherwise: a map, lane dashes.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub distance: Option<f64>,
}

/// As `motorcade run`, with labels. `--out` receives ablation.md and ablation.csv.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  motorcade ablate vehicles kitti/training --sequence 0005 --camera 3 --compare-models models --kitti kitti/training --out tables/0005")]
pub struct VehiclesAblateArguments {
    /// The run that is varied.
    #[command(flatten)]
    pub run: RunArguments,
    /// KITTI tracking split with the ground truth: calib/, gt_poses/, label_02/.
    #[arg(long, value_name = "ROOT")]
    pub kitti: PathBuf,
    /// Folder of ONNX networks to compare with those of the run; may be repeated.
    #[arg(long, value_name = "DIR")]
    pub compare_models: Vec<PathBuf>,
}

fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    (number.is_finite() && number > 0.0).then_some(number).ok_or_else(|| format!("{text} is not more than 0"))
}

/// As `motorcade run`, with ground truth. `--out` receives ablation.md and ablation.csv.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade ablate odometry kitti/training --sequence 0005 --camera 3 --kitti kitti/training --out tables/0005
  motorcade ablate odometry kitti/odometry/00 --calibration camera.toml --ground-truth poses.txt --out tables/00
  motorcade ablate paper kitti/training --sequence 0005 --camera 3 --kitti kitti/training --out tables/paper
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
