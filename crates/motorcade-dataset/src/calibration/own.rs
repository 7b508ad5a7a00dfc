//! The project's own TOML format: flat; unknown fields are an error.
//!
//! ```toml
//! fx = 721.5377      # px
//! fy = 721.5377      # px
//! cx = 609.5593      # px, pixel centres at integer coordinates
//! cy = 172.854       # px
//! width = 1242       # px, optional: checked against the frames
//! height = 375       # px, optional
//! fps = 10.0         # optional
//! height_m = 1.65    # camera above the road, optional
//! readout_ms = 30.0  # from the first row to the last of a rolling shutter, optional; 0 (the default) for a global one
//! # view_deg = 80.0  # horizontal view of the undistorted frames, optional; by default the lens decides
//!
//! [distortion]       # optional, each field optional
//! model = "radial-tangential"    # k1 k2 p1 p2 k3; or "rational": k4 k5 k6 too; or "fisheye": k1 k2 k3 k4
//! k1 = 0.0
//! k2 = 0.0
//! p1 = 0.0
//! p2 = 0.0
//! k3 = 0.0
//!
//! [sigma]            # optional: standard deviations, as `motorcade calibrate` writes them
//! focal_px = 8.0     # of fx and fy, which share it; enters the uncertainty of the scale
//! cx = 5.0           # px, for information
//! cy = 5.0           # px, for information
//! k1 = 0.01          # for information
//! ```

use std::path::Path;

use motorcade_geometry::{Distortion, Fisheye, Pose, RadialTangential, Rational};

use super::{Calibration, READOUT_RANGE_MS};
use crate::error::{Error, Result};

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    width: Option<u32>,
    height: Option<u32>,
    fps: Option<f64>,
    height_m: Option<f64>,
    readout_ms: Option<f64>,
    view_deg: Option<f64>,
    #[serde(default)]
    distortion: Lens,
    sigma: Option<Sigma>,
}

/// Standard deviations.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Sigma {
    focal_px: f64,
    #[expect(dead_code, reason = "for information")]
    cx: Option<f64>,
    #[expect(dead_code, reason = "for information")]
    cy: Option<f64>,
    #[expect(dead_code, reason = "for information")]
    k1: Option<f64>,
}

#[derive(Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Lens {
    model: Model,
    k1: Option<f64>,
    k2: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    k5: Option<f64>,
    k6: Option<f64>,
}

#[derive(Clone, Copy, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Model {
    #[default]
    RadialTangential,
    Rational,
    Fisheye,
}

impl Lens {
    fn distortion(&self, path: &Path) -> Result<Distortion> {
        let [k1, k2, p1, p2, k3, k4, k5, k6] =
            [self.k1, self.k2, self.p1, self.p2, self.k3, self.k4, self.k5, self.k6]
                .map(|k| k.unwrap_or(0.0));
        let (distortion, others) = match self.model {
            Model::RadialTangential => (
                Distortion::RadialTangential(RadialTangential { k1, k2, p1, p2, k3 }),
                [("k4", self.k4), ("k5", self.k5), ("k6", self.k6), ("", None)],
            ),
            Model::Rational => {
                (Distortion::Rational(Rational { k1, k2, p1, p2, k3, k4, k5, k6 }), [("", None); 4])
            }
            Model::Fisheye => (
                Distortion::Fisheye(Fisheye { k1, k2, k3, k4 }),
                [("p1", self.p1), ("p2", self.p2), ("k5", self.k5), ("k6", self.k6)],
            ),
        };
        if let Some((name, _)) = others.iter().find(|(_, value)| value.is_some()) {
            let known: Vec<&str> = distortion.coefficients().iter().map(|(name, _)| *name).collect();
            return Err(Error::input(
                path,
                format!(
                    "{name} is no coefficient of the model \"{}\", which has {}",
                    distortion.model(),
                    known.join(", ")
                ),
            ));
        }
        Ok(distortion)
    }
}

pub(super) fn parse(path: &Path, text: &str) -> Result<Calibration> {
    let file: File =
        toml::from_str(text).map_err(|e| Error::input(path, format!("not a calibration: {e}")))?;
    let size = match (file.width, file.height) {
        (Some(width), Some(height)) => Some((width, height)),
        (None, None) => None,
        _ => return Err(Error::input(path, "give both width and height, or neither")),
    };
    if let Some(readout_ms) = file.readout_ms.filter(|ms| !READOUT_RANGE_MS.contains(ms)) {
        return Err(Error::input(
            path,
            format!(
                "readout_ms = {readout_ms}: the time in which all rows are read must lie between 0 and 200 ms"
            ),
        ));
    }
    Ok(Calibration {
        dialect: "motorcade TOML",
        fx: file.fx,
        fy: file.fy,
        cx: file.cx,
        cy: file.cy,
        size,
        distortion: file.distortion.distortion(path)?,
        view_deg: file.view_deg,
        fps: file.fps,
        height_m: file.height_m,
        readout_ms: file.readout_ms.unwrap_or(0.0),
        focal_sigma: file.sigma.map(|sigma| sigma.focal_px / file.fx),
        camera_from_cam0: Pose::identity(),
    })
}

impl Calibration {
    /// As the project's own TOML; standard deviations of f, k1 \[1\], cx and cy \[px\] stand in it. Lenses other than radial-tangential ones
    /// lose their coefficients beyond k3.
    pub fn to_toml(&self, [focal_px, k1, cx, cy]: [f64; 4]) -> String {
        let mut text =
            format!("fx = {:.4}\nfy = {:.4}\ncx = {:.4}\ncy = {:.4}\n", self.fx, self.fy, self.cx, self.cy);
        if let Some((width, height)) = self.size {
            text += &format!("width = {width}\nheight = {height}\n");
        }
        if self.readout_ms > 0.0 {
            text += &format!("readout_ms = {}\n", self.readout_ms);
        }
        if let Distortion::RadialTangential(RadialTangential { k1, k2, p1, p2, k3 }) = self.distortion
            && !self.distortion.is_none()
        {
            text += &format!(
                "\n[distortion]\nk1 = {k1:.7}\nk2 = {k2:.7}\np1 = {p1:.7}\np2 = {p2:.7}\nk3 = {k3:.7}\n"
            );
        }
        text + &format!("\n[sigma]\nfocal_px = {focal_px:.2}\ncx = {cx:.2}\ncy = {cy:.2}\nk1 = {k1:.5}\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back() {
        let text = "fx = 700.5\nfy = 700.5\ncx = 600.25\ncy = 180.125\nwidth = 1242\nheight = 375\nreadout_ms = 30.0\n[distortion]\nk1 = -0.25\n\
                    [sigma]\nfocal_px = 7.005\ncx = 3.0\ncy = 4.0\nk1 = 0.01\n";
        let read = parse(Path::new("camera.toml"), text).unwrap();
        assert!((read.focal_sigma.unwrap() - 0.01).abs() < 1e-12);
        let again = parse(Path::new("camera.toml"), &read.to_toml([7.005, 0.01, 3.0, 4.0])).unwrap();
        assert!((again.focal_sigma.unwrap() - 0.01).abs() < 1e-5);
        assert_eq!(Calibration { focal_sigma: None, ..again }, Calibration { focal_sigma: None, ..read });
        assert_eq!(again.readout_ms, 30.0);
        let refused = parse(Path::new("camera.toml"), &text.replace("30.0", "-1.0")).unwrap_err();
        assert!(refused.to_string().contains("readout_ms = -1"), "{refused}");
        assert!(parse(Path::new("camera.toml"), &text.replace("[sigma]", "[sigmas]")).is_err());
    }
}
