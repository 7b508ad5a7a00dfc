//! `motorcade ablate`: one drive, many configurations, a table of errors.

mod baseline;
mod cues;
mod paper;
mod relative_scale;
mod scale;
mod sources;
mod suites;
mod table;
mod vehicles;

use std::path::Path;

use motorcade::{Config, FrontEndRecord, RunResult, Settings, estimate_drive, output};
use motorcade_dataset::{Trajectory, read_trajectory};
use motorcade_evaluate::{EgoReport, VehicleReport, evaluate_trajectory};
use motorcade_geometry::{Camera, Pose, World};

use crate::arguments::{AblateArguments, AblateCommand, RunArguments};
use crate::drive::{Drive, LoadedDrive};
use crate::evaluation::evaluate_result;
use crate::exit;
use crate::files::{Content, OutFile};
use crate::progress::Reporter;
use crate::run::overlaid;
use suites::Variant;

/// Errors of one variant.
pub struct Row {
    /// Name of the variant.
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
        AblateCommand::Paper(arguments) => paper::paper(arguments),
        AblateCommand::Scale(arguments) => scale::scale(arguments),
        AblateCommand::Vehicles(arguments) => vehicles::vehicles(arguments),
    }
}

fn odometry(arguments: &AblateArguments) -> anyhow::Result<u8> {
    let mut ablation = Ablation::of(arguments)?;
    let mut rows = Vec::new();
    for variant in suites::odometry() {
        let (record, settings) = ablation.front_end(&ablation.config(&variant)?)?;
        if record.interrupted {
            break;
        }
        let result = estimate_drive(record, &settings, &ablation.reporter);
        rows.push(ablation.row(&variant, &settings.config, &result)?);
        if rows.len() == 1 {
            rows.extend(ablation.true_scale(&result)?);
        }
    }
    ablation.write_tables(&table::odometry(&rows), &table::csv(&rows))
}

fn graph(arguments: &AblateArguments) -> anyhow::Result<u8> {
    let mut ablation = Ablation::of(arguments)?;
    let base = overlaid(Config::default(), &arguments.run)?;
    // The front end does not depend on the options of the graph: one pass over the frames serves all variants.
    let (record, base) = ablation.front_end(&base)?;
    let mut rows = Vec::new();
    for variant in suites::graph() {
        if record.interrupted || motorcade::Progress::cancelled(&ablation.reporter) {
            break;
        }
        let settings = Settings { config: ablation.config(&variant)?, ..base.clone() };
        let result = estimate_drive(record.clone(), &settings, &ablation.reporter);
        rows.push(ablation.row(&variant, &settings.config, &result)?);
    }
    ablation.write_tables(&table::graph(&rows), &table::csv(&rows))
}

/// Ground truth of a drive, where there is one.
#[derive(Clone, Copy)]
struct Truth<'a> {
    /// KITTI tracking split.
    kitti: Option<&'a Path>,
    /// Trajectory of the camera.
    camera: Option<&'a Path>,
}

/// A drive with its ground truth.
struct Ablation<'a> {
    run: &'a RunArguments,
    truth: Truth<'a>,
    /// Poses of `truth.camera`, read before the frames are.
    trajectory: Option<Trajectory<World, Camera>>,
    drive: LoadedDrive,
    reporter: Reporter,
}

impl<'a> Ablation<'a> {
    fn of(arguments: &'a AblateArguments) -> anyhow::Result<Self> {
        let AblateArguments { run, kitti, ground_truth } = arguments;
        Self::open(run, Truth { kitti: kitti.as_deref(), camera: ground_truth.as_deref() })
    }

    fn open(run: &'a RunArguments, truth: Truth<'a>) -> anyhow::Result<Self> {
        let trajectory = truth.camera.map(read_trajectory).transpose()?;
        output::prepare_folder(&run.out)?;
        let drive = Drive::open(run)?.load(run, &overlaid(Config::default(), run)?)?.record()?;
        Ok(Self { run, truth, trajectory, drive, reporter: Reporter::new(run.progress) })
    }

    fn config(&self, variant: &Variant) -> anyhow::Result<Config> {
        let mut config = overlaid(Config::preset(variant.preset), self.run)?;
        for assignment in &variant.set {
            config = config.set(assignment)?;
        }
        Ok(config)
    }

    /// Passes over the frames.
    fn front_end(&mut self, config: &Config) -> anyhow::Result<(FrontEndRecord, Settings)> {
        let mut slam = self.drive.slam(config)?;
        self.drive.survey(&mut slam, &self.reporter);
        self.drive.push_all(&mut slam, &self.reporter, &mut |_, _| ())?;
        Ok(slam.into_record())
    }

    fn row(&self, variant: &Variant, config: &Config, result: &RunResult) -> anyhow::Result<Row> {
        let unsolved = config.graph.enabled && result.graph.is_none();
        let note = if unsolved { " (graph not solved: front end)" } else { "" };
        let name = format!("{}{note}", variant.name);
        let (ego, vehicles) = match self.truth.kitti {
            Some(kitti) => {
                let report = evaluate_result(result, &self.drive.context(*config, String::new()), kitti)?;
                (report.ego, report.vehicles.unwrap_or_default())
            }
            None => {
                let poses: Vec<_> = result.ego.frames.iter().map(|f| f.world_from_camera).collect();
                let numbers: Vec<u64> = result.frames.iter().map(|f| f.number).collect();
                (evaluate_trajectory(&poses, &self.poses(&numbers)?)?, Vec::new())
            }
        };
        tracing::info!("{name}: ATE {:.3} m, SE(3)", ego.ate_se3_m);
        Ok(Row { name, ego, vehicles })
    }

    /// True poses of the frames of the run, from `--ground-truth`.
    fn poses(&self, numbers: &[u64]) -> anyhow::Result<Vec<Pose<World, Camera>>> {
        let Some((path, whole)) = self.truth.camera.zip(self.trajectory.as_ref()) else {
            return Ok(Vec::new());
        };
        if whole.poses.len() == numbers.len() {
            return Ok(whole.poses.clone());
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
    fn true_scale(&self, result: &RunResult) -> anyhow::Result<Option<Row>> {
        if self.truth.camera.is_none() {
            return Ok(None);
        }
        let numbers: Vec<u64> = result.frames.iter().map(|f| f.number).collect();
        let truth = self.poses(&numbers)?;
        let poses: Vec<_> = result.ego.frames.iter().map(|f| f.world_from_camera).collect();
        let ego = evaluate_trajectory(&suites::with_true_scale(&poses, &truth), &truth)?;
        Ok(Some(Row { name: "floor: true scale of ±5 frames".to_owned(), ego, vehicles: Vec::new() }))
    }

    fn write_tables(self, table: &str, csv: &str) -> anyhow::Result<u8> {
        let interrupted = motorcade::Progress::cancelled(&self.reporter);
        self.reporter.finish();
        let out = &self.run.out;
        for (name, text) in [("ablation.md", table), ("ablation.csv", csv)] {
            let path = out.join(name);
            OutFile::create(&path, Content::Table)?.write(text)?;
        }
        exit::say(table.trim_end());
        Ok(if interrupted { exit::INTERRUPTED } else { exit::FINE })
    }
}
