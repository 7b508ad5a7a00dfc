//! KITTI `calib.txt`: one 3×4 projection a camera, of the odometry, tracking and raw benchmarks. Older files of the odometry
//! benchmark have no names: their rows of 12 numbers are cameras 0 to 3.

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
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    first.is_some_and(is_unnamed)
        || text.lines().any(|line| line.split_whitespace().next().is_some_and(|key| camera_of(key).is_some()))
}

/// A row of 12 numbers.
fn is_unnamed(line: &str) -> bool {
    let mut fields = line.split_whitespace();
    line.split_whitespace().count() == 12 && fields.all(|field| field.parse::<f64>().is_ok())
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
        let mut unnamed = 0;
        for row in file.rows() {
            let Some(key) = row.fields.first() else { continue };
            if row.fields.len() == 12 && key.parse::<f64>().is_ok() {
                let p: [f64; 12] = row.numbers(0, "a number of the projection")?;
                // Poses have 12 numbers too.
                if [p[1], p[4], p[8], p[9]] != [0.0; 4] || p[10] != 1.0 {
                    return Err(row.error("a projection K [I | t] of a rectified camera", "12 other numbers"));
                }
                let Some(projection) = calibration.projections.get_mut(unnamed) else {
                    return Err(row.error("at most four rows of 12 numbers, cameras 0 to 3", "a fifth"));
                };
                *projection = Some(p);
                unnamed += 1;
                continue;
            }
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
            return Err(Error::input(
                path,
                "has no line P0: .. P3: with 12 numbers, and no rows of 12 numbers alone",
            ));
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
            view_deg: None,
            fps: None,
            height_m: None,
            readout_ms: 0.0,
            focal_sigma: None,
            camera_from_cam0: Pose::from_parts(UnitQuaternion::identity(), shift),
        })
    }
}
