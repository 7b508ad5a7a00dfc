//! The command line.

mod ablate;
mod batch;
mod calibrate;
mod draw;
mod evaluate;
mod export;
mod graph;
mod kernel;
mod map;
mod shape;
mod simulate;
mod tables;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use motorcade_dataset::{ClockOffset, Format, FrameRange};

pub use self::ablate::{AblateArguments, AblateCommand, ScaleAblateArguments, VehiclesAblateArguments};
pub use self::batch::BatchArguments;
pub use self::calibrate::CalibrateArguments;
pub use self::draw::DrawArguments;
pub use self::evaluate::EvaluateArguments;
pub use self::export::ExportArguments;
pub use self::graph::{CompareArguments, GraphCommand, InfoArguments, OptimiseArguments};
pub use self::kernel::KernelChoice;
pub use self::map::{MapCommand, MapExportArguments, MapMergeArguments};
pub use self::shape::ShapeCommand;
pub use self::simulate::{DemoArguments, SimulateArguments, Training};
pub use self::tables::TablesArguments;

/// Monocular multi-body SLAM for driving video: one camera in, metric trajectories of the camera and of every vehicle out.
#[derive(Debug, Parser)]
#[command(name = "motorcade", version, propagate_version = true, max_term_width = 110)]
#[command(after_help = "Examples:
  motorcade demo
  motorcade inspect drive.mp4
  motorcade calibrate drive.mp4 --out camera.toml
  motorcade run drive.mp4 --calibration camera.toml --height 1.4 --out runs/drive
  motorcade run kitti/training --sequence 0005 --camera 3 --out runs/0005
  motorcade batch drives.csv --out fleet --jobs 8
  motorcade draw runs/drive --out overlay.mp4
  motorcade export runs/drive --out map --track drive.gpx
  motorcade tables runs/* --out tables
  motorcade evaluate runs/0005 --kitti kitti/training --sequence 0005 --camera 3
  motorcade graph optimise sphere.g2o --out solved.g2o

Exit codes: 0 fine, 1 usage, 2 a bug, 3 input unreadable, 4 tracking failed on too many frames (results written),
5 resources, 130 interrupted (results written).")]
pub struct Cli {
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Trajectories of the camera and of every vehicle from driving video.
    Run(Box<RunArguments>),
    /// Every drive of a list, or of a part of it: a process a drive, with bounds, retries and resumption.
    Batch(Box<BatchArguments>),
    /// Describes an input: frames, size, calibration, gaps, duplicates.
    Inspect(InspectArguments),
    /// Finds focal length, distortion and mounting of a camera by a drive with turns, with standard deviations.
    Calibrate(CalibrateArguments),
    /// Draws what a run estimated into the frames of its drive: a video, or pictures.
    Draw(DrawArguments),
    /// A run on the map (GeoJSON, GPX, KML, KITTI's oxts) and as a scenario for simulators (OpenSCENARIO).
    Export(ExportArguments),
    /// Places of drives that were kept by `run --save-map`: facts, files for other programs, two maps made one.
    #[command(subcommand)]
    Map(MapCommand),
    /// Frames and vehicles of many runs as one dataset of Parquet files, for pandas, polars and DuckDB.
    Tables(TablesArguments),
    /// Errors of a run against the ground truth of a KITTI tracking sequence.
    Evaluate(EvaluateArguments),
    /// Tables of what each choice of the method gives, on a drive with ground truth.
    #[command(subcommand)]
    Ablate(AblateCommand),
    /// Renders a synthetic drive, runs everything on it, evaluates and writes the report. Needs nothing.
    Demo(DemoArguments),
    /// Renders a synthetic drive with exact ground truth, in the shape of KITTI tracking.
    Simulate(SimulateArguments),
    /// Optimises, describes and compares pose graphs in g2o files.
    #[command(subcommand)]
    Graph(GraphCommand),
    /// Writes, converts and describes shape priors of vehicles.
    #[command(subcommand)]
    Shape(ShapeCommand),
    /// All settings as commented TOML on stdout; `run --config` accepts it, and a `run.json` too.
    #[command(
        after_help = "Examples:\n  motorcade config > settings.toml\n  motorcade config --set vehicles.traffic_side=left"
    )]
    Config(ConfigArguments),
    /// Lists networks with kind, licence and hash.
    #[command(after_help = "Examples:\n  motorcade models\n  motorcade models --models my-networks")]
    Models(ModelsArguments),
    /// Loads the networks of a folder and runs those for a picture of this size; `run` starts it for networks of a folder.
    #[command(hide = true, name = "probe-models")]
    ProbeModels(ProbeArguments),
    /// Shell completions on stdout.
    #[command(
        after_help = "Example:\n  motorcade completions bash > ~/.local/share/bash-completion/completions/motorcade"
    )]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// `motorcade probe-models`.
#[derive(Debug, Args)]
pub struct ProbeArguments {
    /// Folder of ONNX networks.
    pub folder: PathBuf,
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
}

/// `motorcade models`.
#[derive(Debug, Args)]
pub struct ModelsArguments {
    /// Folder of ONNX networks instead of those inside the program.
    #[arg(long, env = "MOTORCADE_MODELS")]
    pub models: Option<PathBuf>,
}

/// `motorcade config`.
#[derive(Debug, Args)]
pub struct ConfigArguments {
    /// Settings to start from.
    #[arg(long, value_enum, default_value_t)]
    pub preset: PresetName,
    /// Configuration file over the preset.
    #[arg(long)]
    pub config: Option<PathBuf>,
    /// One setting over both, stage.key=value; may be given several times.
    #[arg(long)]
    pub set: Vec<String>,
}

/// Input and selection of its frames.
#[derive(Clone, Debug, Args)]
pub struct InputArguments {
    /// KITTI tracking split, KITTI odometry or raw folder, folder of images, or video file. For `run --online` also a live source:
    /// `-` (a video on standard input), an address such as rtsp://HOST/PATH, or a camera such as /dev/video0.
    pub input: PathBuf,
    /// Kind of input, when looking at it is not enough.
    #[arg(long, value_parser = parse_format)]
    pub format: Option<Format>,
    /// Sequence of a KITTI tracking split, such as 0005.
    #[arg(long)]
    pub sequence: Option<String>,
    /// Camera of a KITTI rig.
    #[arg(long)]
    pub camera: Option<u8>,
    /// Calibration: our TOML, KITTI calib.txt, OpenCV, ORB-SLAM, ROS camera_info or Kalibr YAML; or `auto`, with `run`: by the drive
    /// itself, as `motorcade calibrate` does.
    #[arg(long, value_name = "FILE|auto")]
    pub calibration: Option<PathBuf>,
    /// Frames to take, by the input's own numbers: A..B (B not included), A.., ..B.
    #[arg(long, default_value = "..")]
    pub frames: FrameRange,
    /// Take every N-th frame.
    #[arg(long, default_value_t = 1)]
    pub stride: usize,
    /// Mask, or folder of masks by frame number, of pixels to ignore (non-zero): a bonnet, burnt-in text.
    #[arg(long)]
    pub ignore: Option<PathBuf>,
    /// Frames per second, where the input does not say.
    #[arg(long)]
    pub fps: Option<f64>,
}

impl InputArguments {
    /// True where the calibration is estimated from the drive.
    pub fn calibrates(&self) -> bool {
        self.calibration.as_ref().is_some_and(|path| path.as_os_str() == "auto")
    }

    /// As the dataset crate wants them.
    pub fn options(&self) -> motorcade_dataset::SequenceOptions {
        motorcade_dataset::SequenceOptions {
            uncalibrated: self.calibrates(),
            format: self.format,
            sequence: self.sequence.clone(),
            camera: self.camera,
            calibration: self.calibration.clone().filter(|_| !self.calibrates()),
            fps: self.fps,
            frames: self.frames,
            stride: self.stride,
            ignore: self.ignore.clone(),
            ..Default::default()
        }
    }
}

/// `motorcade run`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  motorcade run drive.mp4 --calibration camera.toml --height 1.4 --out runs/drive
  motorcade run frames/ --calibration camera.yaml --height 1.2 --detections boxes.txt --out runs/frames
  motorcade run kitti/training --sequence 0003 --frames 16..101 --ignore kitti/training/mask_02/0003 \\
      --out runs/0003

Without any frame, from files alone (a KITTI split with calib/ but no images):
  motorcade run kitti/training --sequence 0003 --frames 10..133 --trajectory ego.txt --trajectory-scale metric \\
      --detections kitti/training/label_02/0003.txt --vehicle-poses poses/3_*.csv --out runs/files

With the estimates drawn into the frames:
  motorcade run drive.mp4 --calibration camera.toml --height 1.4 --out runs/drive --overlay runs/drive/overlay.mp4

In the world of an earlier drive through the same streets:
  motorcade run monday.mp4 --calibration camera.toml --height 1.4 --out runs/monday --save-map streets.map
  motorcade run tuesday.mp4 --calibration camera.toml --height 1.4 --out runs/tuesday --map streets.map

As it comes, from a camera of the network:
  motorcade run rtsp://192.168.1.20/stream --online --calibration camera.toml --height 1.4 --out runs/live

Vehicles, their keypoints and the road are found by the networks inside the program. With --models none, and without --detections, no
vehicles are looked for; the camera's trajectory is still metric.")]
pub struct RunArguments {
    /// The input.
    #[command(flatten)]
    pub input: InputArguments,
    /// Directory of the results, new or empty; made whole or not at all.
    #[arg(long)]
    pub out: PathBuf,
    /// Also draw the estimates into the frames, as `motorcade draw` does: a video (.mp4, .m4v, .mov, .mkv, .avi), or a folder of
    /// PNG pictures.
    #[arg(long, value_name = "FILE")]
    pub overlay: Option<PathBuf>,
    /// Also write a recording for Foxglove, rerun and other readers of MCAP: pictures, calibration, transforms, vehicles, speeds.
    #[arg(long, value_name = "FILE.mcap")]
    pub mcap: Option<PathBuf>,
    /// Messages of that recording: Foxglove's for Foxglove and rerun, or those of ROS 2.
    #[arg(long, value_enum, default_value_t, requires = "mcap")]
    pub mcap_schemas: McapSchemas,
    /// Also write the places of the drive, with landmarks and descriptors, into a file: `motorcade map` reads it.
    #[arg(long, value_name = "FILE.map")]
    pub save_map: Option<PathBuf>,
    /// Places of an earlier drive through the same streets, as --save-map wrote them: where they are seen again, this drive is estimated in the
    /// world of that one; with --online from then on.
    #[arg(long, value_name = "FILE.map", conflicts_with = "trajectory")]
    pub map: Option<PathBuf>,
    /// Also write frames.parquet and tracks.parquet: the tables with types, units and the camera's pose.
    #[arg(long)]
    pub parquet: bool,
    /// Also show frames and estimates in rerun while the run goes on: the address of a viewer, or a file .rrd.
    #[cfg(feature = "rerun")]
    #[arg(long, value_name = "ADDRESS|FILE.rrd")]
    pub rerun: Option<motorcade_rerun::Target>,
    /// Height of the camera above the road in metres, or `auto`: by the sizes of the cars that are seen. KITTI input knows its own
    /// (1.65).
    #[arg(long, value_name = "METRES|auto", allow_negative_numbers = true)]
    pub height: Option<CameraHeight>,
    /// Speeds of the car: a CSV file with the columns time (seconds, or RFC 3339), speed_mps, speed_kmh or speed_mph, and optionally
    /// sigma_mps. With --height they correct each other, with --height auto they give the metres.
    #[arg(long, value_name = "FILE", group = "distances", conflicts_with = "online")]
    pub speed: Option<PathBuf>,
    /// GPS track of the drive: .gpx, .nmea, or .csv with columns time, latitude, longitude and optionally altitude, sigma_m. It serves
    /// as --speed does.
    #[arg(long, value_name = "FILE", group = "distances", conflicts_with = "online")]
    pub gps: Option<PathBuf>,
    /// Offset in seconds from the clock of the frames (0 at the start of a video) to that of --speed or --gps, and its standard
    /// deviation (2 s by default); it is then refined. 0 ± 1 s without this option.
    #[arg(long, value_name = "SECONDS[,SIGMA]", allow_hyphen_values = true, requires = "distances")]
    pub clock_offset: Option<ClockOffset>,
    /// Folder of ONNX networks, or `none`; the networks inside the program by default.
    #[arg(long, env = "MOTORCADE_MODELS")]
    pub models: Option<PathBuf>,
    /// Detections instead of a network: KITTI tracking labels, MOT Challenge, or frame,x1,y1,x2,y2,score.
    #[arg(long)]
    pub detections: Option<PathBuf>,
    /// Folder of road masks by frame number instead of a network.
    #[arg(long)]
    pub road_masks: Option<PathBuf>,
    /// Perception of an earlier run, as --keep-perception wrote it: no network runs.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["detections", "road_masks", "keypoints"])]
    pub perception: Option<PathBuf>,
    /// Write the output of all detectors too (perception.jsonl), for runs with --perception.
    #[arg(long)]
    pub keep_perception: bool,
    /// Go on with a run of the same command that was killed or stopped: after the last frame of the state beside its
    /// checkpoint, with what its networks found; the results are the same bytes as those of an unbroken run. Without a checkpoint the run starts at the first frame.
    #[arg(long)]
    pub resume: bool,
    /// Camera trajectory (TUM or KITTI, of the processed camera) instead of odometry.
    #[arg(long)]
    pub trajectory: Option<PathBuf>,
    /// Unit of --trajectory.
    #[arg(long, value_enum, default_value_t)]
    pub trajectory_scale: TrajectoryScale,
    /// Vehicle poses (CSV with frame, track_id, tx, ty, tz, R00, R02) instead of our own localisation; may be repeated.
    #[arg(long, num_args = 1..)]
    pub vehicle_poses: Vec<PathBuf>,
    /// Keypoints of vehicles (CSV with frame, track_id, layout, index, x_px, y_px, confidence): the shape prior is fitted to
    /// them.
    #[arg(long)]
    pub keypoints: Option<PathBuf>,
    /// Shape prior (JSON, see motorcade shape) in place of our own for keypoints of its number.
    #[arg(long, requires = "keypoints")]
    pub shape_prior: Option<PathBuf>,
    /// Estimates camera and vehicles of every frame as it comes, from that frame and those before it alone: one JSON object a
    /// frame on stdout. The results are then those estimates.
    #[arg(long)]
    pub online: bool,
    /// Ready-made settings.
    #[arg(long, value_enum, default_value_t)]
    pub preset: PresetName,
    /// Settings from a TOML file.
    #[arg(long)]
    pub config: Option<PathBuf>,
    /// One setting, such as road.far_heights=12; may be repeated.
    #[arg(long = "set", value_name = "STAGE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Threads; the results do not depend on it. 0 takes all cores.
    #[arg(long, default_value_t = 0, value_parser = parse_threads)]
    pub threads: usize,
    /// Seed of all random choices.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Form of the progress on stderr.
    #[arg(long, value_enum, default_value_t)]
    pub progress: ProgressKind,
    /// Replace an earlier run in --out; only files that its run.json lists are removed.
    #[arg(long)]
    pub force: bool,
}

/// Presets.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum PresetName {
    /// The best we know.
    #[default]
    Default,
    /// The method of Nair et al. 2020.
    Paper,
}

/// Units of a given trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TrajectoryScale {
    /// Up to scale: the road gives the metres; without frames, vehicles that stand.
    #[default]
    Unknown,
    /// Metres.
    Metric,
}

/// Kinds of progress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ProgressKind {
    /// A bar on a terminal, plain lines elsewhere.
    #[default]
    Auto,
    /// Lines of text.
    Plain,
    /// One JSON object a line.
    Json,
    /// Nothing.
    None,
}

/// Messages of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum McapSchemas {
    /// Foxglove's, as protobuf.
    #[default]
    Foxglove,
    /// Those of ROS 2's common interfaces, as CDR: `ros2 bag`, RViz, Foxglove.
    Ros2,
}

impl From<McapSchemas> for motorcade_mcap::Schemas {
    fn from(schemas: McapSchemas) -> Self {
        match schemas {
            McapSchemas::Foxglove => Self::Foxglove,
            McapSchemas::Ros2 => Self::Ros2,
        }
    }
}

/// `motorcade inspect`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  motorcade inspect kitti/training --sequence 0005 --camera 3 --json")]
pub struct InspectArguments {
    /// The input.
    #[command(flatten)]
    pub input: InputArguments,
    /// Pictures that are read and compared with the one before, from the first on; 0 reads none.
    #[arg(long, value_name = "PICTURES", default_value_t = 150)]
    pub compare: usize,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

fn parse_format(text: &str) -> Result<Format, String> {
    let known = Format::ALL.map(Format::name);
    Format::ALL.into_iter().find(|f| f.name() == text).ok_or_else(|| format!("one of {}", known.join(", ")))
}

/// A time from 0 to thirty years.
fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s: &f64| (0.0..=1e9).contains(s));
    seconds.ok_or_else(|| "a number of seconds from 0 to 1e9".to_owned())
}

/// A number of frames: ten thousand seconds at ten a second are the most that a simulated road is built for.
fn parse_frames(text: &str) -> Result<usize, String> {
    let most = 100_000;
    text.parse().ok().filter(|n| *n <= most).ok_or_else(|| format!("a number from 0 to {most}"))
}

/// More threads than any machine has are a slip of the finger, and starting them takes minutes.
fn parse_threads(text: &str) -> Result<usize, String> {
    let most = 1024;
    text.parse().ok().filter(|n| *n <= most).ok_or_else(|| format!("a number from 0 to {most}"))
}

/// Height of the camera above the road.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraHeight {
    /// Stated \[m\].
    Metres(f64),
    /// To be estimated.
    Auto,
}

impl std::str::FromStr for CameraHeight {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        text.parse()
            .map(Self::Metres)
            .map_err(|_| format!("`{text}` is neither a number of metres nor `auto`"))
    }
}
