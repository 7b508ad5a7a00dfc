//! Vehicle poses of another system as CSV with a header: columns `frame`, `track_id`, `tx`, `ty`, `tz` (camera frame, metres; any
//! point on the vehicle's vertical axis) and `R00`, `R02` of a rotation about the camera's y axis that turns z into the vehicle's
//! forward direction, found by name. Other columns, ground truth among them, are ignored.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::labels::MOST_IN_FRAME;
use crate::regular_file;
use crate::text::LARGEST;

const COLUMNS: &str = "columns frame, track_id, tx, ty, tz, R00, R02";

/// Pose of a vehicle in a frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
pub struct ExternalVehiclePose {
    /// The input's own frame number.
    pub frame: u64,
    /// Identity.
    pub track_id: i64,
    /// Right of the camera \[m\].
    pub tx: f64,
    /// Below the camera \[m\].
    pub ty: f64,
    /// In front of the camera \[m\].
    pub tz: f64,
    /// Cosine of the heading about y.
    #[serde(rename = "R00")]
    pub r00: f64,
    /// Sine of the heading about y.
    #[serde(rename = "R02")]
    pub r02: f64,
}

/// Reads files of poses into one list.
///
/// # Errors
/// A file that does not read, a missing column, a cell that is no number, a vehicle that is not in front of the camera; file and
/// line are named.
pub fn read_vehicle_poses(paths: &[PathBuf]) -> Result<Vec<ExternalVehiclePose>> {
    let mut all = Vec::new();
    for path in paths {
        read_one(path, &mut all)?;
    }
    Ok(all)
}

fn read_one(path: &Path, all: &mut Vec<ExternalVehiclePose>) -> Result<()> {
    let at = |line: u64, expected: &str, found: String| Error::Line {
        path: path.to_path_buf(),
        line: usize::try_from(line).unwrap_or(usize::MAX),
        expected: expected.to_owned(),
        found,
    };
    let problem = |e: csv::Error| at(e.position().map_or(1, csv::Position::line), COLUMNS, e.to_string());
    let mut reader = csv::Reader::from_reader(regular_file::open(path).map_err(Error::io(path))?);
    let mut in_frame = BTreeMap::new();
    for (k, row) in reader.deserialize().enumerate() {
        let pose: ExternalVehiclePose = row.map_err(problem)?;
        let numbers = [pose.tx, pose.ty, pose.tz, pose.r00, pose.r02];
        if !numbers.iter().all(|v| v.abs() <= LARGEST) || pose.tz <= 0.0 {
            let expected = "finite numbers and tz in front of the camera";
            return Err(at(k as u64 + 2, expected, format!("{numbers:?}")));
        }
        let count = in_frame.entry(pose.frame).or_insert(0);
        *count += 1;
        if *count > MOST_IN_FRAME {
            let expected = format!("at most {MOST_IN_FRAME} vehicles in a frame");
            return Err(at(k as u64 + 2, &expected, format!("one more in frame {}", pose.frame)));
        }
        all.push(pose);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name_and_problems_name_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_vehicle_poses(std::slice::from_ref(&path))
        };
        let poses = read("track_id,frame,tx,ty,tz,R02,R00,note\n7,3,1,1.5,20,0,1,\"a, b\"\n").unwrap();
        assert_eq!((poses[0].frame, poses[0].track_id, poses[0].tz, poses[0].r00), (3, 7, 20.0, 1.0));
        let header = "frame,track_id,tx,ty,tz,R00,R02\n";
        let problem = |text: &str| read(text).unwrap_err().to_string();
        assert!(problem(&format!("{header}1,1,0,0,-3,1,0\n")).contains(":2: expected finite numbers and tz"));
        assert!(problem(&format!("{header}1,1,0,0,3,1,0\n1,1,0,0,x,1,0\n")).contains(":3"));
        assert!(problem("frame,tx\n1,2\n").contains("R00"));
    }
}
