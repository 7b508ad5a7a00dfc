//! Models of lenses in YAML calibrations: their names and their coefficients.

use motorcade_geometry::{Distortion, Fisheye, RadialTangential, Rational};

use super::document::Document;
use crate::error::{Error, Result};

/// A model that a file names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    RadialTangential,
    Rational,
    Fisheye,
}

impl Model {
    /// By the names of ROS, Kalibr, OpenCV, ORB-SLAM and stella_vslam. `Ok(None)` for names that leave the model open.
    fn named(name: &str) -> std::result::Result<Option<Self>, ()> {
        match name.to_ascii_lowercase().as_str() {
            "" | "pinhole" | "perspective" => Ok(None),
            "plumb_bob" | "radtan" | "radial-tangential" | "rectified" | "none" => {
                Ok(Some(Self::RadialTangential))
            }
            "rational_polynomial" | "rational" => Ok(Some(Self::Rational)),
            "fisheye" | "equidistant" | "equi" | "kannalabrandt8" | "kannala_brandt" => {
                Ok(Some(Self::Fisheye))
            }
            _ => Err(()),
        }
    }
}

impl Document<'_> {
    /// The model the file names under any of these keys; `None` when it names none.
    ///
    /// # Errors
    /// A model that is not known, or two that differ: read as another one it would be silently wrong.
    pub(super) fn model(&self, keys: &[&str]) -> Result<Option<Model>> {
        let mut found: Option<Model> = None;
        for entry in self.entries.iter().filter(|entry| keys.contains(&entry.key.as_str())) {
            let named = Model::named(&entry.value).map_err(|()| {
                self.wrong(
                    entry,
                    "plumb_bob, radtan, rational_polynomial, fisheye, equidistant or KannalaBrandt8; undistort others first",
                )
            })?;
            if let (Some(a), Some(b)) = (found, named)
                && a != b
            {
                return Err(self.wrong(entry, format!("one model of the lens, {a:?} before")));
            }
            found = found.or(named);
        }
        Ok(found)
    }

    /// The lens by a list of coefficients in OpenCV's order. Without a named model five are radial-tangential, eight rational.
    pub(super) fn lens(&self, model: Option<Model>, coefficients: &[f64]) -> Result<Distortion> {
        let at = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
        let used = coefficients.iter().rposition(|c| *c != 0.0).map_or(0, |last| last + 1);
        let refuse = |problem: String| Err(Error::input(self.path, problem));
        if model == Some(Model::Fisheye) {
            return match coefficients.len() {
                0..4 => refuse(format!(
                    "a fisheye lens has k1 k2 k3 k4, found {} coefficients",
                    coefficients.len()
                )),
                _ if used > 4 => refuse(format!("a fisheye lens has k1 k2 k3 k4, found {used} coefficients")),
                _ => Ok(Distortion::Fisheye(Fisheye { k1: at(0), k2: at(1), k3: at(2), k4: at(3) })),
            };
        }
        if used > 8 {
            return refuse(
                "has thin-prism or tilted coefficients (s1 .. s4, tau) that are not zero; calibrate without them, or undistort \
                 the frames first"
                    .to_owned(),
            );
        }
        let (k1, k2, p1, p2, k3) = (at(0), at(1), at(2), at(3), at(4));
        // With k4 = k5 = k6 = 0 both models are the same.
        if used <= 5 {
            return Ok(Distortion::RadialTangential(RadialTangential { k1, k2, p1, p2, k3 }));
        }
        if model == Some(Model::RadialTangential) {
            return refuse(format!("a radial-tangential lens has k1 k2 p1 p2 k3, found {used} coefficients"));
        }
        Ok(Distortion::Rational(Rational { k1, k2, p1, p2, k3, k4: at(5), k5: at(6), k6: at(7) }))
    }
}
