//! How the camera is mounted: against the road and the direction of travel.

use motorcade_calibrate::MountingOptions;
use motorcade_dataset::Sequence;
use motorcade_geometry::robust::{median, sigma_from_absolute};

use crate::error::Result;
use crate::motorcade::Motorcade;
use crate::progress::{NoProgress, Progress};
use crate::record::mean_interval_s;
use crate::result::RunResult;

/// Angles of the mounting, each with a standard deviation \[rad\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// Down from the road's plane.
    pub pitch_rad: (f64, f64),
    /// Clockwise, as the driver sees it, about the axis of the camera.
    pub roll_rad: (f64, f64),
    /// To the right of the direction of travel.
    pub yaw_rad: (f64, f64),
}

/// Runs the drive with its new camera.
pub(super) fn of(
    sequence: &Sequence,
    frames: usize,
    options: &MountingOptions,
    progress: &dyn Progress,
) -> Result<Option<Mounting>> {
    progress.begin("mounting", Some(frames));
    // Angles do not depend on the height.
    let mut slam = Motorcade::builder(sequence.camera()?).height_m(1.0).build()?;
    let stop = || progress.cancelled();
    let mut iter = sequence.frames();
    for row in 0..frames {
        match iter.next_unless(&stop) {
            Some(Ok(frame)) => slam.push(&frame)?,
            Some(Err(bad)) => slam.skip(bad.number, bad.timestamp_ns, &bad.reason.to_string())?,
            None => break,
        }
        progress.advance(row + 1);
    }
    Ok(from(&slam.finish_with(&NoProgress), options))
}

fn from(drive: &RunResult, options: &MountingOptions) -> Option<Mounting> {
    let seen: Vec<_> = drive.ego.frames.iter().filter(|f| f.scale_measured).collect();
    // The normal points up: (0, −1, 0) in a level camera.
    let pitch = seen.iter().map(|f| -f.road_normal.z.atan2(-f.road_normal.y)).collect();
    let roll = seen.iter().map(|f| f.road_normal.x.atan2(-f.road_normal.y)).collect();
    let travel = drive.ego.frames.windows(2).filter_map(|pair| {
        let step = pair[0].world_from_camera.inverse() * pair[1].world_from_camera;
        let (way, turn) = (step.translation(), step.rotation().angle());
        (way.z > 0.0 && turn < options.most_turn_rad_per_m * way.norm()).then(|| way.x.atan2(way.z))
    });
    let interval_s = mean_interval_s(&drive.frames);
    let pitch_rad = centre(pitch, interval_s, options)?;
    let roll_rad = centre(roll, interval_s, options)?;
    let (direction, sigma) = centre(travel.collect(), interval_s, options)?;
    Some(Mounting { pitch_rad, roll_rad, yaw_rad: (-direction, sigma) })
}

/// Median and standard deviation of it, of angles measured every `interval_s`.
fn centre(mut angles: Vec<f64>, interval_s: f64, options: &MountingOptions) -> Option<(f64, f64)> {
    let measured_s = angles.len() as f64 * interval_s;
    if measured_s < options.least_s {
        return None;
    }
    let middle = median(&mut angles)?;
    let mut off: Vec<f64> = angles.iter().map(|a| (a - middle).abs()).collect();
    let independent = (measured_s / options.correlation_time_s).clamp(1.0, angles.len() as f64);
    Some((middle, sigma_from_absolute(&mut off)? / independent.sqrt()))
}

impl Mounting {
    /// In words, a line an angle.
    pub(super) fn lines(&self) -> Vec<String> {
        let line = |name: &str, (angle, sigma): (f64, f64), way: [&str; 2]| {
            let way = if angle < 0.0 { way[1] } else { way[0] };
            format!("{name:<16} {:.2} ± {:.2} degrees {way}", angle.abs().to_degrees(), sigma.to_degrees())
        };
        vec![
            line("pitch", self.pitch_rad, ["down", "up"]),
            line("roll", self.roll_rad, ["clockwise", "anticlockwise"]),
            line(
                "yaw",
                self.yaw_rad,
                ["to the right of the direction of travel", "to the left of the direction of travel"],
            ),
        ]
    }
}
