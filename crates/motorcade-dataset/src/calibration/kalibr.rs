//! Kalibr's camchain (`cam0:`, `cam1:` ..) and the sensor files of the ASL format (one camera, without a prefix).

use super::document::Document;
use super::yaml_camera::YamlCamera;
use crate::error::{Error, Result};

/// `camera` chooses `cam0`, `cam1` ..; the first by default.
pub(super) fn parse(document: &Document<'_>, camera: Option<u8>) -> Result<Option<YamlCamera>> {
    let known: Vec<&str> = document
        .entries
        .iter()
        .filter_map(|entry| entry.key.strip_suffix("intrinsics"))
        .filter(is_camera)
        .collect();
    let prefix = match (known.as_slice(), camera) {
        ([], _) => return Ok(None),
        ([first, ..], None) => (*first).to_owned(),
        ([""], Some(_)) => String::new(),
        (known, Some(camera)) => {
            let wanted = format!("cam{camera}.");
            if !known.contains(&wanted.as_str()) {
                let names: Vec<&str> = known.iter().map(|name| name.trim_end_matches('.')).collect();
                return Err(Error::input(
                    document.path,
                    format!("has no cam{camera}, only {}; choose with --camera", names.join(", ")),
                ));
            }
            wanted
        }
    };
    let key = |name: &str| format!("{prefix}{name}");
    let model = document.model(&[&key("camera_model"), &key("distortion_model"), &key("distortion_type")])?;
    let Some(intrinsics) = document.numbers::<4>(&key("intrinsics"))? else { return Ok(None) };
    let coefficients = document.list(&[&key("distortion_coeffs"), &key("distortion_coefficients")])?;
    let distortion = document.lens(model, &coefficients.unwrap_or_default())?;
    let mut found = YamlCamera::new("Kalibr", intrinsics, distortion);
    found.size = document.numbers::<2>(&key("resolution"))?;
    found.fps = document.number(&[&key("rate_hz")])?;
    Ok(Some(found))
}

/// `camN.`, or nothing.
fn is_camera(prefix: &&str) -> bool {
    let number = prefix.strip_prefix("cam").and_then(|rest| rest.strip_suffix('.'));
    prefix.is_empty() || number.is_some_and(|n| n.parse::<u8>().is_ok())
}
