//! One scenario rendered, run and compared with the truth.

use motorcade::geometry::{Camera, Pose, World};
use motorcade::{Config, Motorcade, NoProgress, RunResult, output, push_sequence};
use motorcade_dataset::{Sequence, SequenceOptions};
use motorcade_evaluate::{Estimates, GroundTruth, Report, evaluate};
use motorcade_perception::{Perception, PerceptionOptions};
use motorcade_simulate::{RenderOptions, Scenario, SensorOptions, WriteOptions, Written, simulate};

use super::cases::Case;

/// A run, and what it is compared with.
pub struct Driven {
    pub result: RunResult,
    pub report: Report,
    pub true_poses: Vec<Pose<World, Camera>>,
}

/// Rendering and running of a scenario.
pub struct Way {
    pub fps: f64,
    pub online: bool,
    /// Time that the rows of a picture take, and what the pipeline takes for it \[s\].
    pub shutter_s: [f64; 2],
    pub seed: u64,
}

/// `MOTORCADE_SUITE_WIDTH` and `MOTORCADE_SUITE_SEED` select others than those of the bounds.
pub fn asked<T: std::str::FromStr>(what: &str, usual: T) -> T {
    std::env::var(format!("MOTORCADE_SUITE_{what}")).ok().and_then(|v| v.parse().ok()).unwrap_or(usual)
}

/// `MOTORCADE_SUITE_SET="stage.key=value ..."` selects other settings than those of the bounds.
fn settings() -> Config {
    let asked = std::env::var("MOTORCADE_SUITE_SET").unwrap_or_default();
    asked.split_whitespace().fold(Config::default(), |config, set| config.set(set).unwrap())
}

/// Renders and runs a case with as many frames as its motion has at this rate.
pub fn drive(case: &Case, way: &Way, perception: impl Fn(&Written) -> PerceptionOptions) -> Driven {
    let Way { fps, online, shutter_s: [readout_s, assumed_s], seed } = *way;
    let scenario = Scenario::by_name(case.name).unwrap();
    let usual = RenderOptions::default();
    let sensor = SensorOptions { readout_s, ..usual.sensor };
    let frames = (case.frames as f64 * fps / usual.fps).round() as usize;
    let render = RenderOptions { weather: case.weather, fps, sensor, ..usual }
        .with_width(asked("WIDTH", case.width_px));
    let drive = simulate(&scenario, frames, seed, &render).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let written = drive.write_kitti(folder.path(), &WriteOptions::default(), &|_| {}).unwrap();

    let options = SequenceOptions {
        sequence: Some(written.sequence.clone()),
        camera: Some(2),
        fps: Some(fps),
        ..SequenceOptions::default()
    };
    let sequence = Sequence::open(&written.training, &options).unwrap();
    let perception = Perception::open(&perception(&written), sequence.size()).unwrap();
    let config = settings();
    let camera_from_cam0 = sequence.camera_from_cam0();
    let mut slam = Motorcade::builder(sequence.camera().unwrap())
        .height_m(scenario.plan.rig.height_m)
        .readout_s(assumed_s)
        .config(config)
        .perception(perception)
        .build()
        .unwrap();
    push_sequence(&mut slam, &sequence, 1, &NoProgress, &mut |_, _| ()).unwrap();
    let result = if online { slam.finish_online(&NoProgress) } else { slam.finish() };
    let estimates = Estimates {
        world_from_camera: result.ego.frames.iter().map(|f| f.world_from_camera).collect(),
        tracks: Some(output::track_labels(&result, camera_from_cam0)),
        ..Estimates::default()
    };
    let estimates = estimates.with_track_table(&output::tracks_csv(&result)).unwrap();
    let truth = GroundTruth::read_kitti(&written.training, &written.sequence, 2, 0).unwrap().with_fps(fps);
    let report = evaluate(&estimates, &truth).unwrap();
    Driven { result, report, true_poses: drive.world_from_camera() }
}
