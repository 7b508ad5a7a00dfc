//! The drive a command works on: frames, or files alone.

use std::sync::Arc;

use motorcade::output::Extra;
use motorcade::{
    Config, External, FrameCallback, Motorcade, Progress, RunContext, push_sequence, survey_sequence,
};
use motorcade_dataset::{KITTI_HEIGHT_M, Sequence, Summary};
use motorcade_geometry::PinholeCamera;
use motorcade_perception::{
    DetectorOptions, Identity, KeptObservations, ModelOptions, ModelSource, Observations, Perception,
    PerceptionOptions, Recording,
};
use motorcade_viewer::Pictures;

use crate::arguments::{CameraHeight, RunArguments};
use crate::checkpoint::Opened;
use crate::frameless::{self, Files};
use crate::progress::Reporter;
use crate::{calibrate, checkpoint, exit, external, models, probe, threads::threads};

/// Name of the calibration in the directory of a run that found it itself.
pub const CAMERA_FILE: &str = "camera.toml";

/// Source of the drive.
enum Source {
    Frames(Box<Sequence>),
    Files(Box<Files>),
}

/// A drive, recognised; nothing large is loaded yet.
pub struct Drive {
    source: Source,
    /// Height of the camera \[m\]; `None` where it is to be estimated.
    pub height_m: Option<f64>,
    /// The camera as estimated from the drive, as text, where nobody calibrated it.
    camera_file: Option<String>,
}

/// Detectors of a run, or their recorded output for several runs.
enum Detectors {
    Live(Perception),
    Recorded(Arc<Recording>),
}

/// A drive with all it needs, ready to run.
pub struct LoadedDrive {
    drive: Drive,
    detectors: Detectors,
    /// Sources of vehicles and road in words.
    perception: (String, String),
    external: External,
    threads: usize,
    /// Output of the detectors as text, where it is kept.
    kept: Option<KeptObservations>,
}

impl Drive {
    /// Recognises the drive of a run.
    pub fn open(arguments: &RunArguments) -> anyhow::Result<Self> {
        if let Some(files) = frameless::open(arguments)? {
            let height_m = match arguments.height {
                None => Some(KITTI_HEIGHT_M),
                Some(CameraHeight::Metres(height_m)) => Some(height_m),
                Some(CameraHeight::Auto) => anyhow::bail!(motorcade_dataset::Error::Usage(
                    "--height auto needs frames: without them the road is not seen; give the height in metres".into()
                )),
            };
            return Ok(Self { source: Source::Files(Box::new(files)), height_m, camera_file: None });
        }
        let live = arguments.online;
        let options = motorcade_dataset::SequenceOptions { live, ..arguments.input.options() };
        let sequence = Sequence::open(&arguments.input.input, &options)?;
        if sequence.is_live() {
            check_live(arguments)?;
        }
        let height_m = match arguments.height {
            Some(CameraHeight::Auto) if arguments.online => anyhow::bail!(motorcade_dataset::Error::Usage(
                "--height auto is known at the end of a drive only; with --online give the height in metres"
                    .into()
            )),
            Some(CameraHeight::Auto) => None,
            Some(CameraHeight::Metres(height_m)) => Some(sequence.height_m(Some(height_m))?),
            None => Some(sequence.height_m(None)?),
        };
        Ok(Self { source: Source::Frames(Box::new(sequence)), height_m, camera_file: None })
    }

    /// With the camera estimated from the drive, where `--calibration auto` asks for it.
    pub fn calibrated(
        mut self,
        arguments: &RunArguments,
        config: &Config,
        reporter: &Reporter,
    ) -> anyhow::Result<Self> {
        if let (Source::Frames(sequence), true) = (&mut self.source, arguments.input.calibrates()) {
            if sequence.is_live() {
                let problem = "--calibration auto needs the whole drive, which a live source has not; calibrate with an earlier drive";
                anyhow::bail!(motorcade_dataset::Error::Usage(problem.into()));
            }
            let found = calibrate::of(sequence, arguments.models.as_deref(), None, config, reporter)?;
            **sequence = sequence.calibrated(CAMERA_FILE.as_ref(), found.calibration())?;
            self.camera_file = Some(found.to_toml());
        }
        Ok(self)
    }

    /// The frames; `None` for a drive known from files only.
    pub fn sequence(&self) -> Option<&Sequence> {
        match &self.source {
            Source::Frames(sequence) => Some(sequence),
            Source::Files(_) => None,
        }
    }

    /// Description of the recognised input.
    pub fn summary(&self) -> Summary {
        match &self.source {
            Source::Frames(sequence) => sequence.summary(),
            Source::Files(files) => files.summary.clone(),
        }
    }

    /// Loads networks and given files.
    pub fn load(self, arguments: &RunArguments, config: &Config) -> anyhow::Result<LoadedDrive> {
        let (mut perception, numbers, times): (_, Vec<u64>, Vec<i64>) = match &self.source {
            Source::Frames(sequence) => {
                // Asked for before the first network is loaded: without it nothing can run.
                sequence.camera()?;
                let perception = open_perception(arguments, sequence, config.perception)?;
                (perception, sequence.numbers().collect(), sequence.timestamps_ns().collect())
            }
            Source::Files(files) => {
                if arguments.keep_perception || arguments.perception.is_some() {
                    let problem =
                        "--keep-perception and --perception need frames: without them nothing is detected";
                    anyhow::bail!(motorcade_dataset::Error::Usage(problem.into()));
                }
                let frames = &files.frames;
                let numbers = frames.iter().map(|f| f.number).collect();
                (Perception::none(), numbers, frames.iter().map(|f| f.timestamp_ns).collect())
            }
        };
        let external = external::read(arguments, &numbers, &times, config)?;
        let words = perception.describe();
        let kept = arguments.keep_perception.then(|| perception.keep());
        let (detectors, threads) = (Detectors::Live(perception), threads(arguments.threads));
        Ok(LoadedDrive { drive: self, detectors, perception: words, external, threads, kept })
    }
}

impl LoadedDrive {
    /// Runs the detectors on every frame once; runs answer from memory from then on.
    pub fn record(mut self) -> anyhow::Result<Self> {
        if let (Source::Frames(sequence), Detectors::Live(perception)) =
            (&self.drive.source, &mut self.detectors)
        {
            // A frame that does not read is a warning of the pass over the frames.
            let recording = perception.record(sequence.frames().flatten())?;
            self.detectors = Detectors::Recorded(Arc::new(recording));
        }
        Ok(self)
    }

    /// Opens the run's checkpoint: takes what the networks found before from there, and writes there what they find now. None where an online
    /// run has no network.
    ///
    /// # Errors
    /// As [`checkpoint::open`].
    pub fn save(
        &mut self,
        arguments: &RunArguments,
        run: Identity,
        keeps_state: bool,
    ) -> anyhow::Result<Option<Opened>> {
        if self.sequence().is_some_and(Sequence::is_live) {
            return Ok(None);
        }
        let Detectors::Live(perception) = &mut self.detectors else { return Ok(None) };
        let observes = !perception.is_none() && arguments.perception.is_none();
        if !observes && !keeps_state {
            if arguments.resume {
                exit::eprint(
                    "motorcade: --resume: no network runs, so that there is nothing to take from a checkpoint",
                );
            }
            return Ok(None);
        }
        let checkpoint = checkpoint::open(&arguments.out, arguments.resume, run)?;
        if let Some(checkpoint) = &checkpoint {
            // Without networks it is the state alone that is worth keeping, unless all output is.
            if observes || arguments.keep_perception {
                perception.save_in(checkpoint.perception.clone());
            }
        }
        Ok(checkpoint)
    }

    /// The estimator for this drive; live detectors go to the first one asked for.
    pub fn slam(&mut self, config: &Config) -> anyhow::Result<Motorcade> {
        let perception = match &mut self.detectors {
            Detectors::Live(perception) => std::mem::take(perception),
            Detectors::Recorded(recording) => recording.replay(),
        };
        let builder = Motorcade::builder(self.camera()?);
        let builder = match self.drive.height_m {
            Some(height_m) => builder.height_m(height_m),
            None => builder.height_by_vehicles(),
        };
        let focal_sigma = self.sequence().and_then(|s| s.calibration()?.focal_sigma);
        let builder = builder.focal_sigma(focal_sigma.unwrap_or(0.0)).config(*config);
        let readout_ms =
            self.sequence().and_then(|s| Some(s.calibration()?.readout_ms)).filter(|ms| *ms > 0.0);
        let builder = match readout_ms {
            Some(readout_ms) => builder.readout_s(1e-3 * readout_ms),
            None => builder,
        };
        let builder = builder.external(self.external.clone()).perception(perception).threads(self.threads);
        Ok(builder.build()?)
    }

    /// True of a drive whose state between two frames can be kept: one of frames.
    pub fn keeps_state(&self) -> bool {
        self.sequence().is_some()
    }

    /// Looks through the first frames for what is fixed to the camera: for drives that are estimated as a whole.
    pub fn survey(&self, slam: &mut Motorcade, reporter: &Reporter) {
        if let Source::Frames(sequence) = &self.drive.source {
            survey_sequence(slam, sequence, reporter);
        }
    }

    /// Pushes all frames.
    pub fn push_all(
        &self,
        slam: &mut Motorcade,
        reporter: &Reporter,
        each: FrameCallback<'_>,
    ) -> motorcade::Result<()> {
        let files = match &self.drive.source {
            Source::Frames(sequence) => return push_sequence(slam, sequence, self.threads, reporter, each),
            Source::Files(files) => files,
        };
        for warning in slam.warnings() {
            reporter.warn(warning);
        }
        reporter.begin("odometry", Some(files.frames.len()));
        for (frame, detections) in files.frames.iter().zip(&files.detections) {
            let observations = Observations { detections: detections.clone(), ..Observations::default() };
            slam.push_without_image(frame.clone(), observations)?;
            each(slam, None);
            if reporter.cancelled() {
                slam.interrupt(files.frames.len());
                break;
            }
        }
        Ok(())
    }

    /// Takes pictures of the frames for the report; none of a drive of files.
    pub fn pictures(&self) -> Pictures {
        self.sequence().map(|sequence| Pictures::new(sequence.len())).unwrap_or_default()
    }

    /// File of the run beside its own: the camera as estimated from the drive.
    pub fn camera_file(&self) -> Option<Extra> {
        let text = self.drive.camera_file.as_ref()?;
        Some(Extra { name: CAMERA_FILE.into(), content: text.clone().into_bytes() })
    }

    /// Files of the run beside its own: what was kept of perception.
    pub fn kept(&self) -> Option<Extra> {
        let text = self.kept.as_ref()?.text();
        Some(Extra { name: "perception.jsonl".into(), content: text.into_bytes() })
    }

    /// The frames; `None` for a drive known from files only.
    pub fn sequence(&self) -> Option<&Sequence> {
        self.drive.sequence()
    }

    /// The camera of the (undistorted) frames.
    pub fn camera(&self) -> anyhow::Result<PinholeCamera> {
        Ok(match &self.drive.source {
            Source::Frames(sequence) => sequence.camera()?,
            Source::Files(files) => files.camera,
        })
    }

    /// Facts about the input that stand in the outputs.
    pub fn context(&self, config: Config, fingerprint: String) -> RunContext {
        let (camera_from_cam0, perception) = match &self.drive.source {
            Source::Frames(sequence) => (sequence.camera_from_cam0(), self.perception.clone()),
            Source::Files(files) => {
                (files.camera_from_cam0, ("file".to_owned(), "level plane: no frames".to_owned()))
            }
        };
        let input = self.drive.summary();
        // Another run on a live source sees other frames.
        let fingerprint = (!self.sequence().is_some_and(Sequence::is_live)).then_some(fingerprint);
        RunContext { config, camera_from_cam0, input, perception, command: command_line(), fingerprint }
    }
}

/// Refuses what needs all frames, or their numbers and times, beforehand or a second time.
fn check_live(arguments: &RunArguments) -> anyhow::Result<()> {
    let given = [
        ("--resume", arguments.resume),
        ("--overlay", arguments.overlay.is_some()),
        ("--mcap", arguments.mcap.is_some()),
        ("--perception", arguments.perception.is_some()),
        ("--trajectory", arguments.trajectory.is_some()),
        ("--vehicle-poses", !arguments.vehicle_poses.is_empty()),
        ("--keypoints", arguments.keypoints.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((name, _)) => anyhow::bail!(motorcade_dataset::Error::Usage(format!(
            "{name} does not go with a live source, whose frames are known once, as they come; record it to a file for that"
        ))),
        None => Ok(()),
    }
}

/// The command line; bytes that are no UTF-8 are replaced.
pub fn command_line() -> Vec<String> {
    std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect()
}

fn open_perception(
    arguments: &RunArguments,
    sequence: &Sequence,
    detectors: DetectorOptions,
) -> anyhow::Result<Perception> {
    if let Some(path) = &arguments.perception {
        let recording = Recording::read(path)?;
        let missing: Vec<u64> = sequence.numbers().filter(|number| !recording.has(*number)).collect();
        if let Some(first) = missing.first() {
            let (missing, all) = (missing.len(), sequence.len());
            let name = path.display();
            let problem = format!("{name} knows nothing of {missing} of {all} frames, the first one {first}");
            anyhow::ensure!(missing < all, motorcade_dataset::Error::Usage(problem));
            exit::eprint(&format!("warning: {problem}; nothing is detected in them"));
        }
        return Ok(Arc::new(recording).replay());
    }
    let options = perception_options(arguments, detectors);
    if let ModelSource::Folder(folder) = &options.models {
        probe::check(folder, sequence.size())?;
    }
    Ok(Perception::open(&options, sequence.size())?)
}

fn perception_options(arguments: &RunArguments, detectors: DetectorOptions) -> PerceptionOptions {
    PerceptionOptions {
        models: models::source(arguments.models.as_deref()),
        detections: arguments.detections.clone(),
        road_masks: arguments.road_masks.clone(),
        without_keypoints: arguments.keypoints.is_some() || !arguments.vehicle_poses.is_empty(),
        networks: ModelOptions { detectors, ..ModelOptions::default() },
    }
}
