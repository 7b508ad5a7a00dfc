//! YAML calibrations: OpenCV and ORB-SLAM (`%YAML:1.0`), ROS `camera_info`.

use std::path::Path;

use motorcade_geometry::{Distortion, Pose};

use super::Calibration;
use super::yaml::{Entry, entries};
use crate::error::{Error, Result};
use crate::text::TextFile;

/// fx, fy, cx, cy \[px\] and the distortion.
type Lens = ([f64; 4], Distortion);

struct Document<'a> {
    path: &'a Path,
    entries: Vec<Entry>,
}

pub(super) fn parse(path: &Path, file: &TextFile) -> Result<Calibration> {
    let document = Document { path, entries: entries(file.text()) };
    document.refuse_other_lenses()?;
    let ([fx, fy, cx, cy], distortion) = match document.orb_slam()? {
        Some(found) => found,
        None => document.matrix()?.ok_or_else(|| {
            Error::input(
                path,
                "no calibration found; expected Camera.fx .. (ORB-SLAM), camera_matrix (OpenCV, ROS camera_info), \
                 P0: .. P3: (KITTI) or fx = .. (our TOML, in a file ending in .toml)",
            )
        })?,
    };
    let width = document.number(&["image_width", "Camera.width", "width", "imageWidth"])?;
    let height = document.number(&["image_height", "Camera.height", "height", "imageHeight"])?;
    Ok(Calibration {
        dialect: if document.get(&["distortion_model"]).is_some() {
            "ROS camera_info"
        } else {
            "OpenCV YAML"
        },
        fx,
        fy,
        cx,
        cy,
        size: width.zip(height).map(|(w, h)| (w as u32, h as u32)),
        distortion,
        fps: document.number(&["Camera.fps", "fps"])?,
        height_m: None,
        camera_from_cam0: Pose::identity(),
    })
}

impl Document<'_> {
    fn get(&self, names: &[&str]) -> Option<&Entry> {
        // A key whose children hold the numbers has no value of its own.
        self.entries.iter().find(|entry| !entry.value.is_empty() && names.contains(&entry.key.as_str()))
    }

    fn wrong(&self, entry: &Entry, expected: impl Into<String>) -> Error {
        Error::Line {
            path: self.path.to_path_buf(),
            line: entry.line,
            expected: expected.into(),
            found: format!("`{}`", entry.value),
        }
    }

    fn number(&self, names: &[&str]) -> Result<Option<f64>> {
        let Some(entry) = self.get(names) else { return Ok(None) };
        entry.value.parse().map(Some).map_err(|_| self.wrong(entry, format!("a number for {}", entry.key)))
    }

    fn list(&self, names: &[&str]) -> Result<Option<Vec<f64>>> {
        let Some(entry) = self.get(names) else { return Ok(None) };
        let items = entry.value.split([',', ' ', '[', ']']).filter(|item| !item.is_empty());
        let parsed: Result<Vec<f64>, _> = items.map(str::parse).collect();
        parsed.map(Some).map_err(|_| self.wrong(entry, format!("a list of numbers for {}", entry.key)))
    }

    /// Rejects other lens models: a fisheye model read as radial-tangential would be silently wrong.
    fn refuse_other_lenses(&self) -> Result<()> {
        let names = ["distortion_model", "Camera.type", "camera_model", "Camera.model"];
        let Some(entry) = self.get(&names) else { return Ok(()) };
        let known = ["plumb_bob", "radtan", "pinhole", "rectified", "none", ""];
        if known.contains(&entry.value.to_ascii_lowercase().as_str()) {
            return Ok(());
        }
        Err(self.wrong(
            entry,
            "a pinhole camera with radial-tangential distortion (plumb_bob); undistort others first",
        ))
    }

    fn orb_slam(&self) -> Result<Option<Lens>> {
        for prefix in ["Camera", "Camera1"] {
            let number = |field: &str| self.number(&[&format!("{prefix}.{field}")]);
            let Some(fx) = number("fx")? else { continue };
            let need = |field: &str| {
                number(field)?.ok_or_else(|| {
                    Error::input(self.path, format!("has {prefix}.fx but no {prefix}.{field}"))
                })
            };
            let or_zero = |field: &str| Ok::<_, Error>(number(field)?.unwrap_or(0.0));
            let distortion = Distortion {
                k1: or_zero("k1")?,
                k2: or_zero("k2")?,
                p1: or_zero("p1")?,
                p2: or_zero("p2")?,
                k3: or_zero("k3")?,
            };
            return Ok(Some(([fx, need("fy")?, need("cx")?, need("cy")?], distortion)));
        }
        Ok(None)
    }

    fn matrix(&self) -> Result<Option<Lens>> {
        let names = ["camera_matrix.data", "camera_matrix", "Camera_Matrix.data", "K", "K.data", "k"];
        let Some(k) = self.list(&names)? else { return Ok(None) };
        if k.len() != 9 {
            return Err(Error::input(
                self.path,
                format!("camera matrix has {} numbers, expected 9", k.len()),
            ));
        }
        let names = [
            "distortion_coefficients.data",
            "distortion_coefficients",
            "Distortion_Coefficients.data",
            "D",
            "D.data",
            "d",
        ];
        let d = self.list(&names)?.unwrap_or_default();
        if d.iter().skip(5).any(|v| *v != 0.0) {
            let problem = "has more than the five coefficients k1 k2 p1 p2 k3; undistort the frames first";
            return Err(Error::input(self.path, problem));
        }
        let at = |i: usize| d.get(i).copied().unwrap_or(0.0);
        let distortion = Distortion { k1: at(0), k2: at(1), p1: at(2), p2: at(3), k3: at(4) };
        Ok(Some(([k[0], k[4], k[2], k[5]], distortion)))
    }
}
