//! OpenCV's YAML (`cv::FileStorage`) and ROS `camera_info`: a camera matrix and a list of coefficients.

use super::document::Document;
use super::model::Model;
use super::yaml_camera::YamlCamera;
use crate::error::{Error, Result};

/// Where files name the model.
pub(super) const MODEL_KEYS: [&str; 4] = ["distortion_model", "Camera.type", "camera_model", "Camera.model"];
const MATRIX: [&str; 6] = ["camera_matrix.data", "camera_matrix", "Camera_Matrix.data", "K", "K.data", "k"];
const COEFFICIENTS: [&str; 12] = [
    "distortion_coefficients.data",
    "distortion_coefficients",
    "Distortion_Coefficients.data",
    "D",
    "D.data",
    "d",
    "dist_coeffs.data",
    "dist_coeffs",
    "dist_coeff.data",
    "dist_coeff",
    "distCoeffs.data",
    "distCoeffs",
];
/// Skew of a camera matrix that is taken for none \[px\].
const LARGEST_SKEW_PX: f64 = 0.5;

pub(super) fn parse(document: &Document<'_>) -> Result<Option<YamlCamera>> {
    let Some(k) = document.list(&MATRIX)? else { return Ok(None) };
    if k.len() != 9 {
        return Err(Error::input(
            document.path,
            format!("camera matrix has {} numbers, expected 9", k.len()),
        ));
    }
    let model = match fisheye_flag(document)? {
        true => Some(Model::Fisheye),
        false => document.model(&MODEL_KEYS)?,
    };
    // OpenCV's fisheye calibration estimates a skew by default.
    if model == Some(Model::Fisheye) && k[1].abs() > LARGEST_SKEW_PX {
        return Err(Error::input(
            document.path,
            format!("camera matrix has a skew of {} px; calibrate with CALIB_FIX_SKEW", k[1]),
        ));
    }
    let coefficients = document.list(&COEFFICIENTS)?.unwrap_or_default();
    let distortion = document.lens(model, &coefficients)?;
    let dialect =
        if document.get(&["distortion_model"]).is_some() { "ROS camera_info" } else { "OpenCV YAML" };
    Ok(Some(YamlCamera::new(dialect, [k[0], k[4], k[2], k[5]], distortion)))
}

/// `fisheye_model: 1`, which OpenCV's calibration sample writes.
fn fisheye_flag(document: &Document<'_>) -> Result<bool> {
    let Some(entry) = document.get(&["fisheye_model"]) else { return Ok(false) };
    match entry.value.to_ascii_lowercase().as_str() {
        "1" | "true" => Ok(true),
        "0" | "false" => Ok(false),
        _ => Err(document.wrong(entry, "0 or 1 for fisheye_model")),
    }
}
