//! The drive a command works on: frames, or files alone.

use motorcade::{Config, External, FrontEnd, RunContext, Watch};
use motorcade_dataset::{KITTI_HEIGHT_M, Sequence, Summary};
use motorcade_geometry::PinholeCamera;
use motorcade_perception::{ModelOptions, Perception, PerceptionOptions};

use crate::arguments::RunArguments;
use crate::pixel_free::{self, Files};
use crate::progress::Reporter;
use crate::{given, run::threads};

/// Where the drive comes from.
enum Source {
    Frames(Box<Sequence>),
    Files(Box<Files>),
}

/// A drive, recognised; nothing large is loaded yet.
pub struct Drive {
    source: Source,
    /// Height of the camera \[m\].
    pub height_m: f64,
}

/// A drive with all it needs, ready to run.
pub struct LoadedDrive {
    drive: Drive,
    perception: Perception,
    /// What files give in place of stages.
    pub given: External,
    threads: usize,
}

impl Drive {
    /// Recognises the drive of a run.
    pub fn open(arguments: &RunArguments) -> anyhow::Result<Self> {
        if let Some(files) = pixel_free::open(arguments)? {
            let height_m = arguments.height.unwrap_or(KITTI_HEIGHT_M);
            return Ok(Self { source: Source::Files(Box::new(files)), height_m });
        }
        let sequence = Sequence::open(&arguments.input.input, &arguments.input.options())?;
        let height_m = sequence.height_m(arguments.height)?;
        Ok(Self { source: Source::Frames(Box::new(sequence)), height_m })
    }

    /// What it was recognised as.
    pub fn summary(&self) -> Summary {
        match &self.source {
            Source::Frames(sequence) => sequence.summary(),
            Source::Files(files) => files.summary.clone(),
        }
    }

    /// Loads networks and given files.
    pub fn load(self, arguments: &RunArguments) -> anyhow::Result<LoadedDrive> {
        let (perception, numbers, times): (_, Vec<u64>, Vec<i64>) = match &self.source {
            Source::Frames(sequence) => {
                // Asked for before the first network is loaded: without it nothing can run.
                sequence.camera()?;
                let perception = Perception::open(&perception_options(arguments), sequence.size())?;
                (perception, sequence.numbers().collect(), sequence.timestamps_ns().collect())
            }
            Source::Files(files) => {
                let frames = &files.input.frames;
                let numbers = frames.iter().map(|f| f.number).collect();
                (Perception::none(), numbers, frames.iter().map(|f| f.timestamp_ns).collect())
            }
        };
        let given = given::read(arguments, &numbers, &times)?;
        Ok(LoadedDrive { drive: self, perception, given, threads: threads(arguments.threads) })
    }
}

impl LoadedDrive {
    /// Height of the camera \[m\].
    pub fn height_m(&self) -> f64 {
        self.drive.height_m
    }

    /// Threads to use.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Looks at every frame once and answers from memory from then on.
    pub fn remember(mut self) -> anyhow::Result<Self> {
        if let Source::Frames(sequence) = &self.drive.source {
            // A frame that does not read is told by the pass over the frames.
            self.perception = self.perception.remember(sequence.frames().flatten())?;
        }
        Ok(self)
    }

    /// Intrinsics.
    pub fn camera(&self) -> anyhow::Result<PinholeCamera> {
        Ok(match &self.drive.source {
            Source::Frames(sequence) => sequence.camera()?,
            Source::Files(files) => files.input.camera,
        })
    }

    /// Passes over the frames.
    pub fn front_end(&self, config: &Config, reporter: &Reporter) -> motorcade::Result<FrontEnd> {
        self.watched_front_end(config, reporter, &mut |_| ())
    }

    /// Passes over the frames; `watch` is told of each.
    pub fn watched_front_end(
        &self,
        config: &Config,
        reporter: &Reporter,
        watch: Watch<'_>,
    ) -> motorcade::Result<FrontEnd> {
        let (given, threads) = (&self.given, self.threads);
        match &self.drive.source {
            Source::Frames(sequence) => {
                FrontEnd::pass(sequence, &self.perception, given, config, threads, reporter, watch)
            }
            Source::Files(files) => FrontEnd::without_frames(files.input.clone(), given, config, watch),
        }
    }

    /// What the outputs need to know.
    pub fn context(&self, config: Config, fingerprint: String) -> RunContext {
        let (camera_from_cam0, perception) = match &self.drive.source {
            Source::Frames(sequence) => (sequence.camera_from_cam0(), self.perception.describe()),
            Source::Files(files) => {
                (files.camera_from_cam0, ("file".to_owned(), "level plane: no frames".to_owned()))
            }
        };
        let input = self.drive.summary();
        RunContext {
            config,
            camera_from_cam0,
            input,
            perception,
            command: std::env::args().collect(),
            fingerprint,
        }
    }
}

fn perception_options(arguments: &RunArguments) -> PerceptionOptions {
    PerceptionOptions {
        models: arguments.models.clone(),
        detections: arguments.detections.clone(),
        road_masks: arguments.road_masks.clone(),
        networks: ModelOptions::default(),
    }
}
