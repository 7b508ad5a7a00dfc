//! Calibrations of videos whose container asks for their pictures to be turned.

use std::path::Path;

use motorcade_geometry::Distortion;

use crate::calibration::Calibration;

/// Way \[px\] by which half a turn may move a principal point without a word: of one in the middle of the picture it is none.
const MOVED_PX: f64 = 1.0;

/// Reason why a calibration may be that of the pictures before they were turned to the left by `turn_deg`, to their `size`. None where the two are told
/// apart, as by the size that it states at a quarter's turn, or are the same, as with the principal point in the middle at half a turn. A file that
/// `motorcade calibrate` wrote, which states its standard deviations, was made of turned pictures.
pub(crate) fn problem(
    file: &Path,
    calibration: &Calibration,
    turn_deg: i32,
    size: (u32, u32),
) -> Option<String> {
    let turn_deg = turn_deg.rem_euclid(360);
    if turn_deg == 0 {
        return None;
    }
    let advice = advice(calibration, turn_deg == 180, size)?;
    Some(format!(
        "the container asks for its pictures to be turned by {turn_deg} degrees to the left; that is done, and {} is taken as the calibration of the turned ones: {advice}",
        file.display()
    ))
}

fn advice(calibration: &Calibration, half: bool, (width, height): (u32, u32)) -> Option<String> {
    if calibration.readout_ms > 0.0 {
        return Some("their rows were not read from the first to the last, leave readout_ms out".to_owned());
    }
    if calibration.focal_sigma.is_some() {
        return None;
    }
    if !half {
        // One of the other orientation does not fit.
        let told_apart = calibration.size.is_some() && width != height;
        let advice = "state width and height in it, so that one of the unturned ones is refused";
        return (!told_apart).then(|| advice.to_owned());
    }
    let (cx, cy) = (f64::from(width - 1) - calibration.cx, f64::from(height - 1) - calibration.cy);
    let moves = (cx - calibration.cx).abs().max((cy - calibration.cy).abs()) > MOVED_PX;
    let signs = if is_tangential(&calibration.distortion) { ", p1 and p2 of the other sign" } else { "" };
    (moves || !signs.is_empty()).then(|| {
        format!("if it was made of the unturned ones, write cx = {cx:.2}, cy = {cy:.2}{signs} into it")
    })
}

/// True for a lens that is not the same when it is turned by half.
fn is_tangential(distortion: &Distortion) -> bool {
    match distortion {
        Distortion::RadialTangential(lens) => lens.p1 != 0.0 || lens.p2 != 0.0,
        Distortion::Rational(lens) => lens.p1 != 0.0 || lens.p2 != 0.0,
        Distortion::Fisheye(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIDDLE: &str = "cx = 31.5\ncy = 23.5\n";
    const ASIDE: &str = "cx = 30.0\ncy = 27.0\nwidth = 64\nheight = 48\n";

    fn said(text: &str, turn_deg: i32, size: (u32, u32)) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        std::fs::write(&path, format!("fx = 50.0\nfy = 50.0\n{text}")).unwrap();
        problem(Path::new("camera.toml"), &Calibration::read(&path, None).unwrap(), turn_deg, size)
    }

    #[test]
    fn half_a_turn_is_named_where_it_moves_the_principal_point() {
        for turn_deg in [180, -180] {
            let said = said(ASIDE, turn_deg, (64, 48)).unwrap();
            assert!(said.contains("turned by 180 degrees") && said.contains("camera.toml"), "{said}");
            assert!(said.contains("cx = 33.00, cy = 20.00 into") && !said.contains("p1"), "{said}");
        }
        assert_eq!(said(ASIDE, 0, (64, 48)), None);
        assert_eq!(said(MIDDLE, 180, (64, 48)), None);
        let tangential = said(&format!("{MIDDLE}[distortion]\np1 = 0.001\n"), 180, (64, 48));
        assert!(tangential.unwrap().contains("p1 and p2 of the other sign"));
        let calibrated = format!("{ASIDE}[sigma]\nfocal_px = 1.0\n");
        assert_eq!(said(&calibrated, 180, (64, 48)), None);
    }

    #[test]
    fn a_quarter_is_named_where_the_calibration_states_no_size() {
        for turn_deg in [90, -90] {
            let said = |text: &str, size| said(text, turn_deg, size);
            assert!(said(MIDDLE, (48, 64)).unwrap().contains("state width and height"));
            assert_eq!(said("cx = 23.5\ncy = 31.5\nwidth = 48\nheight = 64\n", (48, 64)), None);
            assert!(said("cx = 31.5\ncy = 31.5\nwidth = 64\nheight = 64\n", (64, 64)).is_some());
        }
    }

    #[test]
    fn rows_that_were_turned_have_no_readout() {
        for turn_deg in [90, 180] {
            assert!(
                said(&format!("{MIDDLE}readout_ms = 20.0\n"), turn_deg, (64, 48))
                    .unwrap()
                    .contains("readout_ms")
            );
        }
    }
}
