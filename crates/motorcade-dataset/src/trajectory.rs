//! Trajectories as text: TUM (`t x y z qx qy qz qw`) and KITTI (3×4, row-major).

use std::io::{self, Write};
use std::path::Path;

use motorcade_geometry::{Frame, Pose};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::error::{Error, Result};
use crate::text::{Row, TextFile};

/// A trajectory read from a file.
#[derive(Clone, Debug)]
pub struct Trajectory<To: Frame, From: Frame> {
    /// Times \[ns\]; KITTI files have none.
    pub timestamps_ns: Option<Vec<i64>>,
    /// Poses in the order of the lines.
    pub poses: Vec<Pose<To, From>>,
}

/// Reads either format, recognised by the number of columns.
pub fn read_trajectory<To: Frame, From: Frame>(path: &Path) -> Result<Trajectory<To, From>> {
    let file = TextFile::read(path)?;
    let columns = file.rows().next().map(|row| row.fields.len());
    match columns {
        Some(8) => {
            let (mut timestamps_ns, mut poses): (Vec<i64>, _) = (Vec::new(), Vec::new());
            for row in file.rows() {
                let (time_ns, pose) = tum(&row)?;
                if timestamps_ns.last().is_some_and(|last| time_ns < *last) {
                    return Err(row.error("times that do not run backwards", row.fields[0]));
                }
                timestamps_ns.push(time_ns);
                poses.push(pose);
            }
            Ok(Trajectory { timestamps_ns: Some(timestamps_ns), poses })
        }
        Some(_) => Ok(Trajectory {
            timestamps_ns: None,
            poses: file.rows().map(|r| kitti(&r)).collect::<Result<_>>()?,
        }),
        None => {
            Err(Error::input(path, "holds no poses; expected TUM (8 columns) or KITTI (12 columns) lines"))
        }
    }
}

fn tum<To, From>(row: &Row<'_>) -> Result<(i64, Pose<To, From>)> {
    row.require_columns(&[8], "t x y z qx qy qz qw")?;
    let [x, y, z, i, j, k, w] = row.numbers(1, "a number of the pose")?;
    let quaternion = Quaternion::new(w, i, j, k);
    if (quaternion.norm() - 1.0).abs() > 0.01 {
        return Err(
            row.error("a unit quaternion in columns 5 to 8", format!("norm {:.4}", quaternion.norm()))
        );
    }
    let pose = Pose::from_parts(UnitQuaternion::new_normalize(quaternion), Vector3::new(x, y, z));
    Ok((row.nanoseconds(0)?, pose))
}

fn kitti<To, From>(row: &Row<'_>) -> Result<Pose<To, From>> {
    row.require_columns(&[12], "the 12 numbers of a 3x4 pose, row-major")?;
    let m: [f64; 12] = row.numbers(0, "a number of the pose")?;
    let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
    let off = (rotation * rotation.transpose() - Matrix3::identity()).norm();
    if off > 1e-2 || rotation.determinant() < 0.0 {
        return Err(row.error(
            "a rotation matrix in columns 1-3, 5-7, 9-11",
            format!("a matrix that deviates from orthogonality by {off:.2e}"),
        ));
    }
    Ok(Pose::from_matrix(&rotation, &Vector3::new(m[3], m[7], m[11])))
}

/// Writes KITTI lines.
pub fn write_kitti<To, From>(mut to: impl Write, poses: &[Pose<To, From>]) -> io::Result<()> {
    for pose in poses {
        let (r, t) = (pose.rotation_matrix(), pose.translation());
        let row = |i: usize| format!("{:.9e} {:.9e} {:.9e} {:.9e}", r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]);
        writeln!(to, "{} {} {}", row(0), row(1), row(2))?;
    }
    Ok(())
}

/// Writes TUM lines. Times stay exact to the nanosecond.
pub fn write_tum<To, From>(
    mut to: impl Write,
    rows: impl IntoIterator<Item = (i64, Pose<To, From>)>,
) -> io::Result<()> {
    for (time_ns, pose) in rows {
        let (t, q) = (pose.translation(), pose.rotation());
        let sign = if time_ns < 0 { "-" } else { "" };
        let (s, ns) = (time_ns.unsigned_abs() / 1_000_000_000, time_ns.unsigned_abs() % 1_000_000_000);
        let (i, j, k, w) = (q.i, q.j, q.k, q.w);
        writeln!(to, "{sign}{s}.{ns:09} {:.9} {:.9} {:.9} {i:.12} {j:.12} {k:.12} {w:.12}", t.x, t.y, t.z)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::{Camera, World};

    type Path3 = Trajectory<World, Camera>;

    fn pose(i: i32) -> Pose<World, Camera> {
        let v = f64::from(i);
        Pose::from_parts(
            UnitQuaternion::from_euler_angles(0.1 * v, -0.3, 1.2),
            Vector3::new(v, -2.0 * v, 0.25),
        )
    }

    #[test]
    fn both_formats_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.txt");
        let poses: Vec<_> = (0..4).map(pose).collect();
        let times = [0, 100_000_001, 1_403_636_579_763_555_584, 1_403_636_579_813_555_456];
        let close =
            |read: &Path3| read.poses.iter().zip(&poses).all(|(a, b)| (a.inverse() * *b).log().norm() < 1e-8);

        write_tum(std::fs::File::create(&path).unwrap(), times.into_iter().zip(poses.iter().copied()))
            .unwrap();
        let read: Path3 = read_trajectory(&path).unwrap();
        assert_eq!(read.timestamps_ns.as_deref(), Some(&times[..]));
        assert!(close(&read) && read.poses.len() == 4);

        write_kitti(std::fs::File::create(&path).unwrap(), &poses).unwrap();
        let read: Path3 = read_trajectory(&path).unwrap();
        assert!(close(&read) && read.poses.len() == 4 && read.timestamps_ns.is_none());
    }

    #[test]
    fn wrong_lines_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.txt");
        for (text, expected) in [
            ("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1\n", "p.txt:2: expected 12 columns"),
            ("2 0 0 0 0 1 0 0 0 0 1 0\n", "p.txt:1: expected a rotation matrix"),
            ("0.0 1 2 3 0 0 0 0\n", "p.txt:1: expected a unit quaternion"),
            ("0.0 1 2 nan 0 0 0 1\n", "to be finite"),
            ("0.0 1 2 1e300 0 0 0 1\n", "p.txt:1: expected a number of the pose in column 4 to be finite"),
            (
                "0.1 0 0 0 0 0 0 1\n0.2 0 0 0 0 0 0 1\n0.1 0 0 0 0 0 0 1\n",
                "p.txt:3: expected times that do not run backwards",
            ),
            ("1e300 0 0 0 0 0 0 1\n", "p.txt:1: expected a time"),
            ("9223372036854775807.9 0 0 0 0 0 0 1\n", "p.txt:1: expected a time"),
            ("# nothing\n", "holds no poses"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = read_trajectory::<World, Camera>(&path).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
