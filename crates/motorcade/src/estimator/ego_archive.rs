//! Cameras of a drive of any length: the newest in memory, older ones in a temporary file.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};

use motorcade_geometry::Pose;
use motorcade_odometry::{EgoFrame, FrameStatus, Rows};
use nalgebra::{Isometry3, Matrix3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Numbers of a frame: pose, two covariances, the road's normal and tilt, six of the scale, status, three flags in one, inliers.
const NUMBERS: usize = 7 + 36 + 36 + 3 + 9 + 5 + 1 + 1 + 1;

/// Estimated cameras of all frames so far. Results need them at the end of a drive, estimates of later frames do not.
#[derive(Default)]
pub(super) struct EgoArchive {
    rows: Rows<EgoFrame>,
    /// Frames that were forgotten, in order; none where no file can be written.
    file: Option<File>,
    /// True once a file could not be written: everything stays in memory from then on.
    failed: bool,
}

impl EgoArchive {
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

    /// Moves the frames before `row` to the file, many at once.
    pub fn put_away_before(&mut self, row: usize) {
        if self.failed {
            return;
        }
        if self.file.is_none() {
            self.file = tempfile::tempfile().ok();
        }
        let Some(file) = &mut self.file else {
            self.failed = true;
            return;
        };
        let forgotten: Vec<EgoFrame> = self.rows.forget_before(row).collect();
        let bytes: Vec<u8> = forgotten.iter().flat_map(encode).flat_map(f64::to_le_bytes).collect();
        if file.write_all(&bytes).is_err() {
            // The file stays readable up to here; these rows go back into memory.
            self.failed = true;
            let first = self.rows.first_kept() - forgotten.len();
            let kept = forgotten.into_iter().chain(self.rows.iter().cloned()).collect();
            self.rows = Rows::starting_at(first, kept);
        }
    }

    /// All frames, those in the file read back; a warning where they could not be, and stand as bridged where the next one was.
    pub fn into_frames(self) -> (Vec<EgoFrame>, Option<String>) {
        let away = self.rows.first_kept();
        let read = self.file.map_or(Ok(Vec::new()), |file| read_back(file, away));
        let (mut out, lost) = match read {
            Ok(frames) => (frames, None),
            Err(error) => {
                let unknown = |f: &EgoFrame| EgoFrame {
                    status: FrameStatus::Bridged,
                    step_measured: false,
                    ..f.clone()
                };
                let frames = self.rows.iter().next().map(|f| vec![unknown(f); away]);
                let lost =
                    format!("the first {away} poses are lost: a temporary file did not read back ({error})");
                (frames.unwrap_or_default(), Some(lost))
            }
        };
        out.extend(self.rows.iter().cloned());
        (out, lost)
    }
}

fn read_back(mut file: File, count: usize) -> io::Result<Vec<EgoFrame>> {
    file.seek(SeekFrom::Start(0))?;
    let mut reader = BufReader::new(file);
    let mut bytes = [0; 8 * NUMBERS];
    let mut next = |_| reader.read_exact(&mut bytes).map(|()| decode(&bytes));
    (0..count).map(&mut next).collect()
}

fn encode(frame: &EgoFrame) -> [f64; NUMBERS] {
    let (t, q) = (frame.world_from_camera.translation(), frame.world_from_camera.rotation());
    let status = match frame.status {
        FrameStatus::Initialising => 0.0,
        FrameStatus::Tracked => 1.0,
        FrameStatus::Standstill => 2.0,
        FrameStatus::Bridged => 3.0,
    };
    let flags = f64::from(u8::from(frame.step_measured) + 2 * u8::from(frame.scale_measured));
    let mut numbers = [t.x, t.y, t.z, q.i, q.j, q.k, q.w]
        .into_iter()
        .chain(frame.step_covariance.iter().copied())
        .chain(frame.covariance.iter().copied())
        .chain(frame.road_normal.iter().copied())
        .chain(frame.road_tilt_covariance.iter().copied())
        .chain([frame.scale, frame.scale_sigma, frame.scale_sigma_alone, frame.scale_correlation])
        .chain([frame.scale_bias_sigma, status, flags, frame.inliers as f64]);
    std::array::from_fn(|_| numbers.next().unwrap_or(0.0))
}

fn decode(bytes: &[u8; 8 * NUMBERS]) -> EgoFrame {
    let mut numbers = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap_or_default()));
    let mut next = || numbers.next().unwrap_or(0.0);
    let translation = Translation3::new(next(), next(), next());
    let (i, j, k, w) = (next(), next(), next(), next());
    // The quaternion is a unit one already; another rounding would change its bytes.
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    let step_covariance = Matrix6::zeros().map(|_: f64| next());
    let covariance = Matrix6::zeros().map(|_: f64| next());
    let road_normal = Vector3::zeros().map(|_: f64| next());
    let road_tilt_covariance = Matrix3::zeros().map(|_: f64| next());
    let [scale, scale_sigma, scale_sigma_alone, scale_correlation, scale_bias_sigma] =
        std::array::from_fn(|_| next());
    let status = match next() as u8 {
        0 => FrameStatus::Initialising,
        1 => FrameStatus::Tracked,
        2 => FrameStatus::Standstill,
        _ => FrameStatus::Bridged,
    };
    let flags = next() as u8;
    EgoFrame {
        world_from_camera: Pose::new(Isometry3::from_parts(translation, rotation)),
        status,
        step_measured: flags & 1 != 0,
        step_covariance,
        covariance,
        scale,
        scale_sigma,
        scale_sigma_alone,
        scale_correlation,
        scale_bias_sigma,
        scale_measured: flags & 2 != 0,
        road_normal,
        road_tilt_covariance,
        inliers: next() as usize,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

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
}
