//! KITTI `calib.txt`: one 3×4 projection a camera, of the odometry, tracking and raw benchmarks.

use std::path::Path;

use motorcade_geometry::{Distortion, Pose};
use nalgebra::{UnitQuaternion, Vector3};

use super::Calibration;
use crate::error::{Error, Result};
use crate::text::TextFile;

/// Projections (3×4, row-major) of the cameras a KITTI file describes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KittiCalibration {
    projections: [Option<[f64; 12]>; 4],
    sizes: [Option<(u32, u32)>; 4],
}

pub(super) fn looks_like(text: &str) -> bool {
    text.lines().any(|line| line.split_whitespace().next().is_some_and(|key| camera_of(key).is_some()))
}

/// `P2:` (odometry, tracking), `P2` and `P_rect_02:` (raw) name camera 2.
fn camera_of(key: &str) -> Option<usize> {
    let key = key.trim_end_matches(':');
    let digits = key.strip_prefix("P_rect_").or_else(|| key.strip_prefix('P'))?;
    digits.parse().ok().filter(|camera| *camera < 4)
}

impl KittiCalibration {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(path, &TextFile::read(path)?)
    }

    pub(super) fn parse(path: &Path, file: &TextFile) -> Result<Self> {
        let mut calibration = Self::default();
        for row in file.rows() {
            let Some(key) = row.fields.first() else { continue };
            if let Some(camera) =
                key.trim_end_matches(':').strip_prefix("S_rect_0").and_then(|c| c.parse().ok())
            {
                let [width, height] = row.numbers::<2>(1, "an image size")?;
                if let Some(size) = calibration.sizes.get_mut::<usize>(camera) {
                    *size = Some((width as u32, height as u32));
                }
            }
            let Some(camera) = camera_of(key) else { continue };
            row.require_columns(&[13], "a name and the 12 numbers of a 3x4 projection")?;
            calibration.projections[camera] = Some(row.numbers(1, "a number of the projection")?);
        }
        if calibration.projections.iter().all(Option::is_none) {
            return Err(Error::input(path, "has no line P0: .. P3: with 12 numbers"));
        }
        Ok(calibration)
    }

    /// The calibration of one camera. The projection is K [I | t], so `camera_from_cam0` is a shift by t = K⁻¹ p₄.
    pub fn camera(&self, path: &Path, camera: u8) -> Result<Calibration> {
        let Some(p) = self.projections.get(usize::from(camera)).copied().flatten() else {
            let known: Vec<String> =
                (0..4).filter(|i| self.projections[*i].is_some()).map(|i| i.to_string()).collect();
            return Err(Error::input(path, format!("has no camera {camera}, only {}", known.join(", "))));
        };
        let (fx, cx, fy, cy) = (p[0], p[2], p[5], p[6]);
        let z = p[11];
        let shift = Vector3::new((p[3] - cx * z) / fx, (p[7] - cy * z) / fy, z);
        Ok(Calibration {
            dialect: "KITTI",
            fx,
            fy,
            cx,
            cy,
            size: self.sizes.get(usize::from(camera)).copied().flatten(),
            distortion: Distortion::default(),
            fps: None,
            height_m: None,
            camera_from_cam0: Pose::from_parts(UnitQuaternion::identity(), shift),
        })
    }
}
