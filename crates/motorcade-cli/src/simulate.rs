//! `motorcade simulate`.

use std::path::Path;

use anyhow::bail;
use motorcade::Progress;
use motorcade::output::OutputDirectory;
use motorcade_dataset::{Cam0, KittiCalibration, Label, read_labels, read_trajectory};
use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use motorcade_perception::VehicleClass;
use motorcade_simulate::{
    DRIVE_RECORD, Drive, KeypointOptions, MeasureOptions, ReenactOptions, RenderOptions, Scenario,
    SensorOptions, VehicleCropOptions, WriteOptions, Written, labels_in_camera, reenact, scenarios,
    simulate as plan, simulate_again, write_vehicle_crops_until,
};

use crate::arguments::{SimulateArguments, Training};
use crate::drive::command_line;
use crate::exit;
use crate::progress::Reporter;

/// Length of a scenario when no number of frames is given \[s\].
const SCENARIO_S: f64 = 12.0;
/// Longest way between two poses of a real drive \[m\]: 100 m/s at one frame a second.
const LONGEST_STEP_M: f64 = 100.0;
/// Farthest vehicle of a real drive \[m\].
const FARTHEST_M: f64 = 1000.0;

/// Lists scenarios, or renders a scenario or a real drive.
pub fn simulate(arguments: &SimulateArguments) -> anyhow::Result<u8> {
    if arguments.list {
        for scenario in scenarios() {
            exit::print(&format!("{:<20} {}", scenario.name, scenario.description))?;
        }
        return Ok(exit::FINE);
    }
    // clap forgets what is required once it conflicts with something given.
    if arguments.trajectory.is_none() && (arguments.labels.is_some() || arguments.calibration.is_some()) {
        bail!("--labels and --calibration belong to a --trajectory");
    }
    if let Some(view) = arguments.view_deg.filter(|view| !(20.0..=130.0).contains(view)) {
        bail!("--view-deg must lie in [20, 130], got {view}");
    }
    if !(2.0..=60.0).contains(&arguments.fps) {
        bail!("--fps must lie in [2, 60], got {}", arguments.fps);
    }
    // clap asks for it unless --list is given.
    let Some(out) = &arguments.out else { bail!("--out is needed") };
    let directory = OutputDirectory::open(out, DRIVE_RECORD, arguments.force)?;
    if let Some(Training::Vehicle) = arguments.training {
        return crops(arguments, &directory, out);
    }
    let drive = match (&arguments.trajectory, &arguments.scenario) {
        (Some(trajectory), _) => real(trajectory, arguments)?,
        (None, Some(name)) => {
            let frames = arguments.frames.unwrap_or((SCENARIO_S * arguments.fps).round() as usize);
            let seeds = (arguments.seed, arguments.traffic_seed.unwrap_or(arguments.seed));
            visited(name, frames, seeds, &render(arguments))?
        }
        (None, None) => bail!("--scenario or --trajectory is needed"),
    };
    let options = WriteOptions {
        depth: arguments.depth,
        instance: arguments.instance,
        keypoints: arguments
            .keypoints
            .then(|| KeypointOptions { exact: arguments.exact, ..Default::default() }),
        ..WriteOptions::default()
    };
    let written = if arguments.geometry_only {
        let measure = MeasureOptions {
            pixel_sigma_px: arguments.pixel_noise,
            outlier_share: arguments.outliers,
            drop_chance: arguments.drop_outs,
            ..MeasureOptions::default()
        };
        filled(&directory, out, |folder| drive.write_geometry(folder, &options, &measure))?
    } else {
        rendered(&drive, &directory, out, &options, &Reporter::new(arguments.progress))?
    };
    exit::say(&format!(
        "{} frames, {} labelled boxes\n{}",
        drive.len(),
        written.labels,
        out.join("training").display()
    ));
    Ok(exit::FINE)
}

/// Renders a drive into its directory.
pub fn rendered(
    drive: &Drive,
    directory: &OutputDirectory,
    out: &Path,
    options: &WriteOptions,
    reporter: &Reporter,
) -> anyhow::Result<Written> {
    reporter.begin("rendering", Some(drive.len()));
    let written = filled(directory, out, |folder| {
        let (advance, cancelled) = (|done| reporter.advance(done), || reporter.cancelled());
        Ok(drive.write_kitti_until(folder, options, &advance, &cancelled)?.moved(folder, out))
    });
    reporter.finish();
    written
}

/// Fills a directory of simulated data. Errors of writing name it, not the temporary folder.
fn filled<T>(
    directory: &OutputDirectory,
    out: &Path,
    write: impl FnOnce(&Path) -> motorcade_simulate::Result<T>,
) -> anyhow::Result<T> {
    use motorcade_simulate::Error as Simulation;
    let fill = |folder: &Path| {
        write(folder).map_err(|error| match error {
            Simulation::Io { .. } | Simulation::Image { .. } => {
                anyhow::Error::new(error).context(format!("cannot write {}", out.display()))
            }
            _ => error.into(),
        })
    };
    let version = env!("CARGO_PKG_VERSION");
    directory.write(
        fill,
        |files, _| serde_json::json!({"motorcade": version, "command": command_line(), "files": files}),
    )
}

/// Training crops of single vehicles.
fn crops(arguments: &SimulateArguments, directory: &OutputDirectory, out: &Path) -> anyhow::Result<u8> {
    let options = VehicleCropOptions { count: arguments.count, seed: arguments.seed, ..Default::default() };
    let reporter = Reporter::new(arguments.progress);
    reporter.begin("rendering", Some(options.count));
    let made = filled(directory, out, |folder| {
        write_vehicle_crops_until(&options, folder, &|done| reporter.advance(done), &|| reporter.cancelled())
    });
    reporter.finish();
    made?;
    exit::say(&format!("{} crops\n{}", options.count, out.display()));
    Ok(exit::FINE)
}

/// A built-in scenario driven.
pub fn built_in(name: &str, frames: usize, seed: u64, render: &RenderOptions) -> anyhow::Result<Drive> {
    Ok(plan(&scenario(name)?, frames, seed, render)?)
}

/// A built-in scenario driven, or driven again where the seed of the traffic is not that of the streets.
fn visited(name: &str, frames: usize, seeds: (u64, u64), render: &RenderOptions) -> anyhow::Result<Drive> {
    if seeds.0 == seeds.1 {
        return built_in(name, frames, seeds.0, render);
    }
    Ok(simulate_again(&scenario(name)?, frames, seeds, render)?)
}

fn scenario(name: &str) -> anyhow::Result<Scenario> {
    let Some(scenario) = Scenario::by_name(name) else {
        let known: Vec<String> = scenarios().into_iter().map(|s| s.name).collect();
        bail!("unknown scenario `{name}`; known are {}", known.join(", "));
    };
    Ok(scenario)
}

fn render(arguments: &SimulateArguments) -> RenderOptions {
    let sensor = SensorOptions {
        exposure_drift: arguments.exposure_drift,
        blur_samples: arguments.blur_samples,
        shutter_s: arguments.shutter,
        readout_s: 1e-3 * arguments.readout_ms,
        ..SensorOptions::default()
    };
    let (weather, fps, hour) = (arguments.weather, arguments.fps, arguments.hour);
    let usual =
        RenderOptions { weather, sensor, fps, hour, ..RenderOptions::default() }.with_width(arguments.width);
    arguments.view_deg.map_or(usual, |view| usual.with_view(view.to_radians()))
}

/// Refuses motion and vehicles that a road cannot be built for.
fn plausible(
    trajectory: &Path,
    poses: &[Pose<World, Cam0>],
    file: Option<&Path>,
    labels: &[Label],
) -> Result<(), motorcade::Error> {
    let step_m = |w: &[Pose<World, Cam0>]| (w[1].translation() - w[0].translation()).norm();
    if let Some((k, step)) = poses.windows(2).map(step_m).enumerate().find(|(_, step)| *step > LONGEST_STEP_M)
    {
        let problem = format!("pose {} is {step:e} m from the one before, at most {LONGEST_STEP_M} m", k + 1);
        return Err(motorcade::Error::Input(format!("{}: {problem}", trajectory.display())));
    }
    let vehicles = labels.iter().filter(|label| label.class.parse::<VehicleClass>().is_ok());
    for label in vehicles {
        let size_is_fine = label.size_hwl_m.iter().all(|side| (0.2..=40.0).contains(side));
        if !size_is_fine || label.location_m.iter().any(|v| v.abs() > FARTHEST_M) {
            let file = file.map(|f| f.display().to_string()).unwrap_or_default();
            let (size, place) = (label.size_hwl_m, label.location_m);
            return Err(motorcade::Error::Input(format!(
                "{file}: frame {}, track {}: size {size:?} m or location {place:?} m is none of a vehicle in sight",
                label.frame, label.track
            )));
        }
    }
    Ok(())
}

/// A real drive re-enacted.
fn real(trajectory: &Path, arguments: &SimulateArguments) -> anyhow::Result<Drive> {
    if !(0.2..=10.0).contains(&arguments.height) {
        bail!("--height must lie in [0.2, 10] m, got {}", arguments.height);
    }
    let mut poses: Vec<Pose<World, Cam0>> = read_trajectory(trajectory)?.poses;
    if let Some(frames) = arguments.frames {
        if frames > poses.len() {
            bail!("--frames {frames}: {} holds {} poses", trajectory.display(), poses.len());
        }
        poses.truncate(frames);
    }
    let labels = arguments.labels.as_deref().map(read_labels).transpose()?.unwrap_or_default();
    plausible(trajectory, &poses, arguments.labels.as_deref(), &labels)?;
    let (mut render, mut camera_from_cam0) = (render(arguments), Pose::<Camera, Cam0>::identity());
    if let Some(path) = &arguments.calibration {
        let calibration = KittiCalibration::read(path)?.camera(path, arguments.camera)?;
        camera_from_cam0 = calibration.camera_from_cam0;
        // KITTI's tracking files give no size: that of the scenarios is theirs.
        let full = RenderOptions::default().camera;
        let (width, height) = calibration.size.unwrap_or((full.width, full.height));
        let (fx, fy, cx, cy) = (calibration.fx, calibration.fy, calibration.cx, calibration.cy);
        render.camera = PinholeCamera { fx, fy, cx, cy, width, height };
        render = render.with_width(arguments.width);
    }
    let labels = labels_in_camera(&labels, &camera_from_cam0);
    let cam0_from_camera = camera_from_cam0.inverse();
    let poses: Vec<Pose<World, Camera>> = poses.iter().map(|p| *p * cam0_from_camera).collect();
    let options = ReenactOptions {
        height_m: arguments.height,
        first_frame: arguments.first_frame,
        seed: arguments.seed,
        ..ReenactOptions::default()
    };
    let name = trajectory.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok(reenact(&name, &poses, &labels, &options, &render)?)
}
