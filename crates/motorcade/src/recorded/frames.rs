//! The camera of a run, frame by frame.

use std::path::Path;

use motorcade_dataset::{Trajectory, read_trajectory};
use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Matrix6, Vector3};

use super::table::{NamedRow, Table};
use crate::error::{Error, Result};

/// A frame of a run.
#[derive(Clone, Debug)]
pub struct RecordedFrame {
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// Origin of the pose: `tracked`, `standstill`, `bridged`, `filled_in`.
    pub status: String,
    /// Speed around the frame \[m/s\], as `speeds.csv` has it; in directories without that file, over the last interval.
    pub speed_mps: f64,
    /// Its standard deviation \[m/s\]; `None` where it is not known at all.
    pub speed_sigma_mps: Option<f64>,
    /// Unit normal of the road towards the camera, camera frame.
    pub road_normal: Vector3<f64>,
    /// Pose \[m\].
    pub world_from_camera: Pose<World, Camera>,
    /// Covariance of the pose (6×6 `[ω, ν]`, camera frame).
    pub covariance: Matrix6<f64>,
}

pub(super) fn read(directory: &Path) -> Result<Vec<RecordedFrame>> {
    let path = directory.join("frames.csv");
    let table = Table::read(&path)?;
    let poses: Trajectory<World, Camera> = read_trajectory(&directory.join("ego.tum"))?;
    let times = poses.timestamps_ns.unwrap_or_default();
    let covariances = covariances(&directory.join("ego_covariance.csv"))?;
    let speeds = speeds(&directory.join("speeds.csv"))?;
    let mut frames: Vec<RecordedFrame> = Vec::with_capacity(times.len());
    for row in table.rows() {
        let at = frames.len();
        let (Some(pose), Some(time_ns), Some(covariance)) =
            (poses.poses.get(at), times.get(at), covariances.get(at))
        else {
            break;
        };
        let number = row.whole("frame")?;
        if frames.last().is_some_and(|before| before.number >= number) {
            return Err(row.error("frame numbers that increase", number).into());
        }
        let step_mps = row.number("speed_mps")?;
        let of_step = (step_mps, Some(step_mps * row.number("scale_sigma_rel")?));
        let (speed_mps, speed_sigma_mps) = match speeds.as_deref().map(|rows| rows.get(at)) {
            None => of_step,
            Some(Some(speed)) if speed.frame == number => (speed.mps, speed.sigma_mps),
            // One row more or less is named with the other tables below.
            Some(None) => break,
            Some(Some(speed)) => {
                let (path, line) = (directory.join("speeds.csv"), at + 2);
                let problem = format!("expected frame {number}, as in frames.csv, found {}", speed.frame);
                return Err(Error::Input(format!("{}:{line}: {problem}", path.display())));
            }
        };
        let [pitch, roll] = row.numbers(["road_pitch_rad", "road_roll_rad"])?;
        frames.push(RecordedFrame {
            number,
            timestamp_ns: *time_ns,
            status: row.text("status")?,
            speed_mps,
            speed_sigma_mps,
            road_normal: -Vector3::new(roll.tan(), 1.0, pitch.tan()).normalize(),
            world_from_camera: *pose,
            covariance: *covariance,
        });
    }
    let with_speeds = speeds.as_ref().map(|speeds| ("speeds.csv", speeds.len()));
    let lengths = [
        ("frames.csv", table.rows().count()),
        ("ego.tum", times.len()),
        ("ego_covariance.csv", covariances.len()),
    ];
    let lengths: Vec<_> = lengths.into_iter().chain(with_speeds).collect();
    if lengths.iter().any(|(_, length)| *length != frames.len()) {
        let found: Vec<String> = lengths.iter().map(|(name, length)| format!("{name} {length}")).collect();
        return Err(Error::Input(format!(
            "{}: numbers of rows: {}; expected one a frame in each: this directory is not of one finished run; \
             write it anew",
            directory.display(),
            found.join(", ")
        )));
    }
    Ok(frames)
}

/// A row of `speeds.csv`.
struct Speed {
    frame: u64,
    mps: f64,
    sigma_mps: Option<f64>,
}

/// Speeds of the camera; `None` without the file.
fn speeds(path: &Path) -> Result<Option<Vec<Speed>>> {
    if !path.exists() {
        return Ok(None);
    }
    let table = Table::read(path)?;
    let speed = |row: NamedRow<'_>| {
        Ok(Speed {
            frame: row.whole("frame")?,
            mps: row.number("speed_mps")?,
            sigma_mps: row.number_or_none("sigma_speed_mps")?,
        })
    };
    table.rows().map(speed).collect::<Result<_>>().map(Some)
}

/// Covariances of all poses from their upper triangles.
fn covariances(path: &Path) -> Result<Vec<Matrix6<f64>>> {
    let matrix = |values: [f64; 21]| {
        let mut out = Matrix6::zeros();
        let places = (0..6).flat_map(|r| (r..6).map(move |c| (r, c)));
        for ((r, c), value) in places.zip(values) {
            out[(r, c)] = value;
            out[(c, r)] = value;
        }
        out
    };
    let table = Table::read(path)?;
    table.rows().map(|row| Ok(matrix(row.numbers_from(1, "a number of the covariance")?))).collect()
}
