//! Arguments of `motorcade simulate` and `motorcade demo`.

use std::path::PathBuf;

use clap::Args;

use super::ProgressKind;

/// `motorcade simulate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade simulate --list
  motorcade simulate --scenario demo --frames 120 --seed 1 --out drives/demo
  motorcade run drives/demo/training --sequence 0000 --detections drives/demo/training/detections/0000.txt \\
      --road-masks drives/demo/training/road_masks/0000 --out runs/demo")]
pub struct SimulateArguments {
    /// Lists the scenarios, one a line, name first.
    #[arg(long)]
    pub list: bool,
    /// Scenario.
    #[arg(long, required_unless_present = "list")]
    pub scenario: Option<String>,
    /// Frames, ten a second.
    #[arg(long, default_value_t = 120)]
    pub frames: usize,
    /// Seed of all that is random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder the drive goes to, in the shape of KITTI tracking.
    #[arg(long, required_unless_present = "list")]
    pub out: Option<PathBuf>,
    /// Width of the pictures in pixels.
    #[arg(long, default_value_t = 1242)]
    pub width: u32,
    /// Also write depth maps.
    #[arg(long)]
    pub depth: bool,
    /// Also write instance maps.
    #[arg(long)]
    pub instance: bool,
    /// Replace what is in --out.
    #[arg(long)]
    pub force: bool,
    /// How progress is told on stderr.
    #[arg(long, value_enum, default_value_t)]
    pub progress: ProgressKind,
}

/// `motorcade demo`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  motorcade demo --out runs/demo")]
pub struct DemoArguments {
    /// Directory of the results; the drive itself goes beside it, with `-drive` in its name.
    #[arg(long, default_value = "runs/demo")]
    pub out: PathBuf,
    /// Frames, ten a second.
    #[arg(long, default_value_t = 120)]
    pub frames: usize,
    /// Seed of the drive.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Threads; the results do not depend on it. 0 takes all cores.
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// How progress is told on stderr.
    #[arg(long, value_enum, default_value_t)]
    pub progress: ProgressKind,
}
