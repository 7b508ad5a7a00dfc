//! Arguments of `motorcade batch`.

use std::path::PathBuf;

use clap::Args;
use motorcade_fleet::Shard;

use super::ProgressKind;

/// `motorcade batch`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade batch drives.csv --out fleet
  motorcade batch drives.csv --out fleet --jobs 8 --calibration camera.toml --height 1.4 --memory-mb 2000 --timeout 7200
  motorcade batch drives.jsonl --out /data/fleet --shard $SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT

drives.csv has a header and a row a drive; `input` is required, the other columns may be missing or empty:
  id,input,calibration,height,sequence,camera,frames,fps,settings
  monday,videos/monday.mp4,camera.toml,1.4,,,,,
  0005,kitti/training,,,0005,3,0..297,,road.far_heights=12;vehicles.traffic_side=left
More columns, named as the options of `motorcade run`: stride, format, ignore, models, detections, road_masks, perception,
keep_perception, parquet, trajectory, trajectory_scale, vehicle_poses, keypoints, preset, config, seed. Relative paths are relative to the
manifest. Without `id` a drive is named as its input, with sequence and camera.

Each drive is a process of its own. Written are runs/<id> (as `motorcade run` does), logs/<id>.log, state.jsonl and, at the end and
when interrupted, manifest.done.parquet and .csv with a line a drive. The same command goes on where it was interrupted; drives that have
results are left alone unless their row or their files have changed. Tried again are a bug, resources and signals (exit codes 2, 5);
usage and input (1, 3) not before row or files have changed.

Exit codes: 0 every drive has results, 4 all were tried and some have none, 130 interrupted, 1 usage, 3 a manifest that does not
read, 5 a directory that cannot be written.")]
pub struct BatchArguments {
    /// List of the drives: .csv, .parquet, or .jsonl with an object a line.
    pub manifest: PathBuf,
    /// Directory of all results; several shards may share it.
    #[arg(long)]
    pub out: PathBuf,
    /// Drives at a time. 0 takes as many as there are cores.
    #[arg(long, default_value_t = 0, value_parser = super::parse_threads)]
    pub jobs: usize,
    /// Threads of each drive. 0 takes as many as a job has cores: all of them, divided by --jobs.
    #[arg(long, default_value_t = 0, value_parser = super::parse_threads)]
    pub threads: usize,
    /// Let the system place the jobs. By default each one is bound to cores of its own (on Linux, if there are no more jobs than cores and
    /// no quota of processor time), so that none works ahead on another's; results do not depend on it.
    #[arg(long)]
    pub no_pin: bool,
    /// Part of the manifest: drives whose number, from 0, is INDEX modulo COUNT.
    #[arg(long, value_name = "INDEX/COUNT", default_value = "0/1")]
    pub shard: Shard,
    /// Most resident memory of a drive's processes in MB; one that takes more is killed (Linux). The batch takes up to --jobs
    /// times that.
    #[arg(long, value_name = "MB")]
    pub memory_mb: Option<u64>,
    /// Most time of a drive in seconds; one that takes longer is killed.
    #[arg(long, value_name = "SECONDS", value_parser = super::parse_seconds)]
    pub timeout: Option<f64>,
    /// Further attempts at a drive after a failure that may be temporary.
    #[arg(long, default_value_t = 2)]
    pub retries: u32,
    /// Also repeat drives that failed by usage or input (1, 3) and whose row and files are the same.
    #[arg(long)]
    pub retry_failed: bool,
    /// Calibration of rows without their own.
    #[arg(long)]
    pub calibration: Option<PathBuf>,
    /// Height of the camera of rows without their own: metres, or `auto`.
    #[arg(long, value_name = "METRES|auto", allow_negative_numbers = true)]
    pub height: Option<super::CameraHeight>,
    /// Folder of ONNX networks, or `none`, of rows without their own.
    #[arg(long, env = "MOTORCADE_MODELS")]
    pub models: Option<PathBuf>,
    /// Settings from a TOML file for rows without their own.
    #[arg(long)]
    pub config: Option<PathBuf>,
    /// One setting for all rows, such as road.far_heights=12; may be repeated. Those of a row win.
    #[arg(long = "set", value_name = "STAGE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Tables of each run as Parquet too, of rows that say nothing about it; `motorcade tables` joins them.
    #[arg(long)]
    pub parquet: bool,
    /// Form of the progress on stderr.
    #[arg(long, value_enum, default_value_t)]
    pub progress: ProgressKind,
}
