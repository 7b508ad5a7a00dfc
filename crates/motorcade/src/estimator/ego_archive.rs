//! Cameras of a drive of any length: the newest in memory, older ones in a temporary file.

use std::io;
use std::path::PathBuf;

use motorcade_odometry::{EgoFrame, FrameStatus, Rows};

use crate::archive::{Archive, ArchiveState, not_read_back};

/// Estimated cameras of all frames so far. Results need them at the end of a drive, estimates of later frames do not.
#[derive(Default)]
pub(super) struct EgoArchive {
    rows: Rows<EgoFrame>,
    /// Frames before those in memory.
    older: Archive<EgoFrame>,
}

/// State of the cameras between two frames.
#[derive(serde::Serialize, serde::Deserialize)]
pub(super) struct EgoArchiveState {
    rows: Rows<EgoFrame>,
    older: ArchiveState,
}

impl EgoArchive {
    /// With older cameras in a file of this name.
    pub fn named(path: PathBuf) -> Self {
        Self { rows: Rows::default(), older: Archive::named(path) }
    }
    /// The state after the last frame.
    pub fn state(&self) -> io::Result<EgoArchiveState> {
        let Self { rows, older } = self;
        Ok(EgoArchiveState { rows: rows.clone(), older: older.state()? })
    }
    /// As in a state, with the file of this one.
    pub fn resumed(&self, state: EgoArchiveState) -> io::Result<Self> {
        let EgoArchiveState { rows, older } = state;
        if rows.first_kept() != older.len() {
            return Err(io::Error::other("its cameras do not fit together"));
        }
        Ok(Self { rows, older: self.older.resumed(&older)? })
    }

    /// Frames so far.
    pub fn len(&self) -> usize {
        self.rows.len()
    }
    /// True before the first frame.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
    /// A frame that is in memory.
    pub fn get(&self, row: usize) -> Option<&EgoFrame> {
        self.rows.get(row)
    }
    /// The newest frame.
    pub fn newest(&self) -> Option<&EgoFrame> {
        self.rows.last()
    }
    /// Adds the next frame.
    pub fn push(&mut self, frame: EgoFrame) {
        self.rows.push(frame);
    }

    /// Moves the frames before `row` to a temporary file, many at once.
    pub fn put_away_before(&mut self, row: usize) {
        self.older.put_away(self.rows.forget_before(row).collect());
    }

    /// All frames, those put away read back; a warning where they could not be, and stand as bridged where the next one was.
    pub fn into_frames(self) -> (Vec<EgoFrame>, Option<String>) {
        let Self { mut rows, mut older } = self;
        let away = rows.first_kept();
        let lost = match older.take_back() {
            Ok(older) => {
                rows.put_back(older);
                None
            }
            Err(error) => {
                let unknown = |f: &EgoFrame| EgoFrame {
                    status: FrameStatus::Bridged,
                    step_measured: false,
                    ..f.clone()
                };
                let next = rows.kept().first().map(unknown);
                rows.put_back(next.map(|f| vec![f; away]).unwrap_or_default());
                Some(not_read_back(&format!("the first {away} poses"), &error))
            }
        };
        (rows.into_kept(), lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

    fn frame(k: usize) -> EgoFrame {
        let number = |i: usize| ((k * 131 + i * 17) as f64).sin();
        EgoFrame {
            world_from_camera: Pose::exp(&Vector6::from_fn(|i, _| number(i))),
            status: [
                FrameStatus::Initialising,
                FrameStatus::Tracked,
                FrameStatus::Standstill,
                FrameStatus::Bridged,
            ][k % 4],
            step_measured: k.is_multiple_of(2),
            step_covariance: Matrix6::from_fn(|i, j| number(7 + 6 * i + j)),
            covariance: Matrix6::from_fn(|i, j| number(50 + 6 * i + j)),
            scale: number(90),
            scale_sigma: number(91),
            scale_sigma_alone: number(92),
            scale_correlation: number(93),
            scale_bias_sigma: number(94),
            scale_measured: k.is_multiple_of(3),
            road_normal: Vector3::from_fn(|i, _| number(95 + i)),
            road_tilt_covariance: Matrix3::from_fn(|i, j| number(98 + 3 * i + j)),
            inliers: k,
        }
    }

    #[test]
    fn frames_come_back_as_they_were_and_few_are_in_memory() {
        let mut archive = EgoArchive::default();
        for k in 0..3000_usize {
            archive.push(frame(k));
            archive.put_away_before((k + 1).saturating_sub(150));
            assert!(archive.rows.kept().len() < 600 && archive.len() == k + 1);
        }
        let (frames, lost) = archive.into_frames();
        assert_eq!((frames.len(), lost), (3000, None));
        for (k, found) in frames.iter().enumerate() {
            assert_eq!(format!("{found:?}"), format!("{:?}", frame(k)), "frame {k}");
        }
    }

    #[test]
    fn poses_that_are_lost_stand_as_bridged() {
        let mut archive = EgoArchive::default();
        (0..600).for_each(|k| archive.push(frame(k)));
        archive.put_away_before(500);
        archive.older.break_file();
        let (frames, lost) = archive.into_frames();
        assert!(frames.len() == 600 && lost.is_some_and(|text| text.contains("first 500 poses")));
        assert!(frames[..500].iter().all(|f| f.status == FrameStatus::Bridged));
    }
}
