//! `motorcade ablate`: one drive, many configurations, a table of errors.

mod suites;
mod table;

use motorcade::{Config, FrontEnd, RunResult, estimate_drive, output, write_run};
use motorcade_dataset::{Trajectory, read_trajectory};
use motorcade_evaluate::{EgoReport, VehicleReport, evaluate_run, evaluate_trajectory};
use motorcade_geometry::{Camera, Pose, World};

use crate::arguments::{AblateArguments, AblateCommand};
use crate::drive::{Drive, LoadedDrive};
use crate::progress::Reporter;
use crate::run::overlaid;
use crate::{exit, files};
use suites::Variant;

/// Errors of one variant.
pub struct Row {
    /// What it is.
    pub name: String,
    /// Camera.
    pub ego: EgoReport,
    /// Vehicles, where there is ground truth of them.
    pub vehicles: Vec<VehicleReport>,
}

/// Runs a suite, prints its table and writes it.
pub fn ablate(command: &AblateCommand) -> anyhow::Result<u8> {
    match command {
        AblateCommand::Odometry(arguments) => odometry(arguments),
        AblateCommand::Graph(arguments) => graph(arguments),
    }
}

fn odometry(arguments: &AblateArguments) -> anyhow::Result<u8> {
    let ablation = Ablation::open(arguments)?;
    let mut rows = Vec::new();
    for variant in suites::odometry() {
        let config = ablation.config(&variant)?;
        let front_end = ablation.drive.front_end(&config, &ablation.reporter)?;
        if front_end.interrupted {
            break;
        }
        rows.push(ablation.row(&variant, &config, front_end)?);
        if rows.len() == 1 {
            rows.extend(ablation.true_scale(&config)?);
        }
    }
    ablation.conclude(&rows, table::odometry(&rows))
}

fn graph(arguments: &AblateArguments) -> anyhow::Result<u8> {
    let ablation = Ablation::open(arguments)?;
    let base = overlaid(Config::default(), &arguments.run)?;
    // Nothing a variant changes is looked at before the graph: one pass over the frames serves them all.
    let front_end = ablation.drive.front_end(&base, &ablation.reporter)?;
    let mut rows = Vec::new();
    for variant in suites::graph() {
        if front_end.interrupted || motorcade::Progress::cancelled(&ablation.reporter) {
            break;
        }
        rows.push(ablation.row(&variant, &ablation.config(&variant)?, front_end.clone())?);
    }
    ablation.conclude(&rows, table::graph(&rows))
}

/// A drive with its ground truth.
struct Ablation<'a> {
    arguments: &'a AblateArguments,
    drive: LoadedDrive,
    reporter: Reporter,
    /// Where runs are written to be evaluated.
    scratch: tempfile::TempDir,
}

impl<'a> Ablation<'a> {
    fn open(arguments: &'a AblateArguments) -> anyhow::Result<Self> {
        let run = &arguments.run;
        output::prepare_folder(&run.out)?;
        let drive = Drive::open(run)?.load(run)?.remember()?;
        let scratch = tempfile::Builder::new().prefix(".motorcade-").tempdir_in(&run.out)?;
        Ok(Self { arguments, drive, reporter: Reporter::new(run.progress), scratch })
    }

    fn config(&self, variant: &Variant) -> anyhow::Result<Config> {
        let mut config = overlaid(Config::preset(variant.preset), &self.arguments.run)?;
        for assignment in &variant.set {
            config = config.set(assignment)?;
        }
        Ok(config)
    }

    /// Runs what follows the frames, and evaluates.
    fn row(&self, variant: &Variant, config: &Config, front_end: FrontEnd) -> anyhow::Result<Row> {
        let (height_m, threads) = (self.drive.height_m(), self.drive.threads());
        let result = estimate_drive(front_end, &self.drive.given, height_m, config, threads, &self.reporter);
        let row = self.evaluate(variant, config, &result)?;
        tracing::info!("{}: ATE {:.3} m, SE(3)", row.name, row.ego.ate_se3_m);
        Ok(row)
    }

    fn evaluate(&self, variant: &Variant, config: &Config, result: &RunResult) -> anyhow::Result<Row> {
        let name = variant.name.clone();
        let Some(kitti) = &self.arguments.kitti else {
            let poses: Vec<_> = result.ego.frames.iter().map(|f| f.world_from_camera).collect();
            let numbers: Vec<u64> = result.frames.iter().map(|f| f.number).collect();
            let ego = evaluate_trajectory(&poses, &self.truth(&numbers)?)?;
            return Ok(Row { name, ego, vehicles: Vec::new() });
        };
        let context = self.drive.context(*config, String::new());
        let folder = self.scratch.path().join("run");
        write_run(&folder, result, &context, &[])?;
        let sequence = context.input.sequence.clone().unwrap_or_default();
        let camera = context.input.camera.unwrap_or(2);
        let first = result.frames.first().map_or(0, |f| f.number);
        let report = evaluate_run(&folder, kitti, &sequence, camera, first)?;
        Ok(Row { name, ego: report.ego, vehicles: report.vehicles.unwrap_or_default() })
    }

    /// True poses of the frames of the run, from `--ground-truth`.
    fn truth(&self, numbers: &[u64]) -> anyhow::Result<Vec<Pose<World, Camera>>> {
        let Some(path) = &self.arguments.ground_truth else { return Ok(Vec::new()) };
        let whole: Trajectory<World, Camera> = read_trajectory(path)?;
        if whole.poses.len() == numbers.len() {
            return Ok(whole.poses);
        }
        let of = |n: &u64| usize::try_from(*n).ok().and_then(|n| whole.poses.get(n)).copied();
        let problem = || {
            let (poses, frames) = (whole.poses.len(), numbers.len());
            motorcade::Error::Input(format!(
                "{}: holds {poses} poses for {frames} frames; expected one a frame of the run or one for every frame number",
                path.display()
            ))
        };
        numbers.iter().map(of).collect::<Option<Vec<_>>>().ok_or_else(|| problem().into())
    }

    /// The floor: the same odometry with the true scale of ±5 frames put in. Only with the camera's own ground truth.
    fn true_scale(&self, config: &Config) -> anyhow::Result<Option<Row>> {
        if self.arguments.ground_truth.is_none() {
            return Ok(None);
        }
        let front_end = self.drive.front_end(config, &self.reporter)?;
        let (height_m, threads) = (self.drive.height_m(), self.drive.threads());
        let numbers: Vec<u64> = front_end.frames.iter().map(|f| f.number).collect();
        let truth = self.truth(&numbers)?;
        let result = estimate_drive(front_end, &self.drive.given, height_m, config, threads, &self.reporter);
        let poses: Vec<_> = result.ego.frames.iter().map(|f| f.world_from_camera).collect();
        let ego = evaluate_trajectory(&suites::with_true_scale(&poses, &truth), &truth)?;
        Ok(Some(Row { name: "floor: true scale of ±5 frames".to_owned(), ego, vehicles: Vec::new() }))
    }

    fn conclude(self, rows: &[Row], table: String) -> anyhow::Result<u8> {
        let interrupted = motorcade::Progress::cancelled(&self.reporter);
        self.reporter.finish();
        let out = &self.arguments.run.out;
        for (name, text) in [("ablation.md", &table), ("ablation.csv", &table::csv(rows))] {
            let path = out.join(name);
            files::write(files::beside(&path)?, &path, text)?;
        }
        exit::print(table.trim_end());
        Ok(if interrupted { exit::INTERRUPTED } else { exit::FINE })
    }
}
