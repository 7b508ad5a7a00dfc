//! Arguments of `motorcade simulate` and `motorcade demo`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use motorcade_simulate::Weather;

use super::ProgressKind;

/// Kinds of training data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Training {
    /// Crops of single vehicles.
    Vehicle,
}

/// `motorcade simulate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade simulate --list
  motorcade simulate --scenario demo --frames 120 --seed 1 --out drives/demo
  motorcade simulate --scenario dense --weather rain --keypoints --depth --out drives/rain
  motorcade simulate --scenario block --frames 980 --traffic-seed 2 --hour 16 --out drives/block-again
  motorcade simulate --scenario dense --geometry-only --out drives/measurements
  motorcade simulate --training vehicle --count 40000 --seed 1 --out crops
  motorcade simulate --trajectory kitti/training/gt_poses/0005.txt --labels kitti/training/label_02/0005.txt \\
      --calibration kitti/training/calib/0005.txt --camera 3 --out drives/0005
  motorcade run drives/demo/training --sequence 0000 --detections drives/demo/training/detections/0000.txt \\
      --road-masks drives/demo/training/road_masks/0000 --out runs/demo")]
pub struct SimulateArguments {
    /// Lists the scenarios, one a line, name first.
    #[arg(long)]
    pub list: bool,
    /// Scenario.
    #[arg(long, required_unless_present_any = ["list", "trajectory", "training"], conflicts_with = "trajectory")]
    pub scenario: Option<String>,
    /// Re-enacts a real drive: `world_from_cam0`, a KITTI pose (12 numbers) or TUM line a frame.
    #[arg(long, value_name = "FILE")]
    pub trajectory: Option<PathBuf>,
    /// KITTI tracking labels of the vehicles of that drive, in cam0; none are re-enacted without.
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    pub labels: Option<PathBuf>,
    /// KITTI calibration of that drive: the simulated camera takes place and intrinsics of `--camera`. Without it camera 0
    /// is taken over with the intrinsics of the scenarios.
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    pub calibration: Option<PathBuf>,
    /// Camera of the calibration.
    #[arg(long, default_value_t = 2, requires = "calibration")]
    pub camera: u8,
    /// Height of the camera of that drive above the road in metres.
    #[arg(long, default_value_t = 1.65, requires = "trajectory")]
    pub height: f64,
    /// Frame number, in the labels, of the first pose.
    #[arg(long, default_value_t = 0, requires = "trajectory")]
    pub first_frame: u64,
    /// Labelled crops of single vehicles instead of a drive: NumPy arrays of pictures, exact keypoints and other labels.
    #[arg(long, value_enum, value_name = "KIND", conflicts_with_all = ["scenario", "trajectory"])]
    pub training: Option<Training>,
    /// Number of crops, with --training.
    #[arg(long, default_value_t = 1000, requires = "training")]
    pub count: usize,
    /// Frames. By default 12 s of a scenario, all of a trajectory.
    #[arg(long, value_parser = super::parse_frames)]
    pub frames: Option<usize>,
    /// Frames per second, 2 to 60, of the same motion; give the same to `run --fps`.
    #[arg(long, default_value_t = 10.0)]
    pub fps: f64,
    /// Seed of all that is random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Seed of traffic, parked cars, speed and noise of another visit to the streets of --seed, whose camera starts elsewhere; poses in the
    /// world of the first visit are written too. The first visit has as many frames and, by default, this seed: that of --seed.
    #[arg(long, value_name = "SEED", conflicts_with_all = ["trajectory", "training"])]
    pub traffic_seed: Option<u64>,
    /// Time of day, 6 to 18: where the sun stands.
    #[arg(long, default_value_t = 12.0)]
    pub hour: f64,
    /// Folder the drive goes to, in the shape of KITTI tracking.
    #[arg(long, required_unless_present = "list")]
    pub out: Option<PathBuf>,
    /// Width of the pictures in pixels.
    #[arg(long, default_value_t = 1242, value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub width: u32,
    /// Horizontal field of view in degrees, 20 to 130; that of KITTI's cameras, 81, by default.
    #[arg(long, value_name = "DEG", value_parser = clap::value_parser!(f64), conflicts_with_all = ["trajectory", "training"])]
    pub view_deg: Option<f64>,
    /// Also write depth maps.
    #[arg(long)]
    pub depth: bool,
    /// Also write instance maps.
    #[arg(long)]
    pub instance: bool,
    /// Also write 2D keypoints with confidences, of the 36 and of the 14 of the shape prior's layouts.
    #[arg(long)]
    pub keypoints: bool,
    /// Keypoints where they truly are, with confidences by visibility alone, instead of a network's errors.
    #[arg(long, requires = "keypoints")]
    pub exact: bool,
    /// Writes measurements as tables instead of pictures: landmarks, road matches, boxes, keypoints.
    #[arg(long, conflicts_with_all = ["depth", "instance"])]
    pub geometry_only: bool,
    /// Noise of landmarks and road matches in pixels, with --geometry-only.
    #[arg(long, default_value_t = 0.4, requires = "geometry_only")]
    pub pixel_noise: f64,
    /// Share of landmarks and road matches that are wrong, with --geometry-only.
    #[arg(long, default_value_t = 0.03, requires = "geometry_only")]
    pub outliers: f64,
    /// Chance that a landmark or road match is missed, with --geometry-only.
    #[arg(long, default_value_t = 0.05, requires = "geometry_only")]
    pub drop_outs: f64,
    /// Weather.
    #[arg(long, default_value = "clear", value_parser = weather)]
    pub weather: Weather,
    /// Relative amplitude of slow changes of exposure.
    #[arg(long, default_value_t = 0.03)]
    pub exposure_drift: f64,
    /// Motion blur: pictures averaged over the shutter time; 1 for none. Time grows with it.
    #[arg(long, default_value_t = 1, value_parser = parse_blur_samples)]
    pub blur_samples: usize,
    /// Shutter time in seconds; seen only with --blur-samples.
    #[arg(long, default_value_t = 0.006)]
    pub shutter: f64,
    /// Rolling shutter: time in milliseconds from the first row to the last, with the frame's time in the middle; 0 for a global one. Say the
    /// same as `readout_ms` of a camera file to `run --calibration`.
    #[arg(long, value_name = "MS", default_value_t = 0.0, conflicts_with_all = ["geometry_only", "training"])]
    pub readout_ms: f64,
    /// Replace an earlier drive in --out; nothing else in it is removed.
    #[arg(long)]
    pub force: bool,
    /// Form of the progress on stderr.
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
    #[arg(long, default_value_t = 120, value_parser = super::parse_frames)]
    pub frames: usize,
    /// Seed of the drive.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Threads; the results do not depend on it. 0 takes all cores.
    #[arg(long, default_value_t = 0, value_parser = super::parse_threads)]
    pub threads: usize,
    /// Form of the progress on stderr.
    #[arg(long, value_enum, default_value_t)]
    pub progress: ProgressKind,
}

fn parse_blur_samples(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| (1..=256).contains(n)).ok_or_else(|| "a number from 1 to 256".to_owned())
}

fn weather(text: &str) -> Result<Weather, String> {
    let known = Weather::ALL.map(Weather::name);
    Weather::ALL
        .into_iter()
        .find(|w| w.name() == text)
        .ok_or_else(|| format!("known are {}", known.join(", ")))
}
