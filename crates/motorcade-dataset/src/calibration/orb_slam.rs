//! Settings of ORB-SLAM2, ORB-SLAM3 and stella_vslam: `Camera.fx` .., `Camera1.fx` ..

use motorcade_geometry::{Distortion, Fisheye, RadialTangential};

use super::document::Document;
use super::model::Model;
use super::opencv::MODEL_KEYS;
use super::yaml_camera::YamlCamera;
use crate::error::{Error, Result};

pub(super) fn parse(document: &Document<'_>) -> Result<Option<YamlCamera>> {
    for prefix in ["Camera", "Camera1"] {
        let number = |field: &str| document.number(&[&format!("{prefix}.{field}")]);
        let Some(fx) = number("fx")? else { continue };
        let need = |field: &str| {
            number(field)?.ok_or_else(|| {
                Error::input(document.path, format!("has {prefix}.fx but no {prefix}.{field}"))
            })
        };
        let or_zero = |field: &str| Ok::<_, Error>(number(field)?.unwrap_or(0.0));
        let model = document.model(&MODEL_KEYS)?.unwrap_or(Model::RadialTangential);
        let others: &[&str] = match model {
            Model::RadialTangential => &["k4", "k5", "k6"],
            Model::Rational => &[],
            Model::Fisheye => &["p1", "p2", "k5", "k6"],
        };
        for field in others {
            if or_zero(field)? != 0.0 {
                return Err(Error::input(
                    document.path,
                    format!(
                        "{prefix}.{field} is no coefficient of the model {model:?}; name the model in Camera.type"
                    ),
                ));
            }
        }
        let distortion = match model {
            Model::RadialTangential => Distortion::RadialTangential(RadialTangential {
                k1: or_zero("k1")?,
                k2: or_zero("k2")?,
                p1: or_zero("p1")?,
                p2: or_zero("p2")?,
                k3: or_zero("k3")?,
            }),
            Model::Rational => {
                let names = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
                let coefficients: Result<Vec<f64>> = names.into_iter().map(or_zero).collect();
                document.lens(Some(model), &coefficients?)?
            }
            Model::Fisheye => Distortion::Fisheye(Fisheye {
                k1: need("k1")?,
                k2: need("k2")?,
                k3: need("k3")?,
                k4: need("k4")?,
            }),
        };
        let intrinsics = [fx, need("fy")?, need("cx")?, need("cy")?];
        return Ok(Some(YamlCamera::new("OpenCV YAML", intrinsics, distortion)));
    }
    Ok(None)
}
