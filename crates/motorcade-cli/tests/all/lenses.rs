//! Calibrations of wide lenses: what `inspect` says of them, and what is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use crate::common::{answer, drive};

const FISHEYE: &str = "fx = 200.0\nfy = 200.0\ncx = 244.0\ncy = 117.0\nfps = 10.0\n[distortion]\nmodel = \"fisheye\"\nk1 = -0.02\n";

#[test]
fn inspect_names_the_lens_and_the_pinhole() {
    let folder = drive(2);
    std::fs::write(folder.path().join("camera.toml"), FISHEYE).unwrap();
    let text = answer(folder.path(), "inspect frames --calibration camera.toml").stdout;
    for said in [
        "calibration  motorcade TOML: fx 200.00 fy 200.00 cx 244.00 cy 117.00 px",
        "distortion   fisheye k1 -0.02 k2 0 k3 0 k4 0 (undistorted on input)",
        "pinhole      fx 201.38 fy 201.38 cx 239.50 cy 119.50 px, view 100.0 x 61.6 degrees (of the undistorted frames)",
    ] {
        assert!(text.contains(said), "no `{said}` in:\n{text}");
    }
    let plain = drive(2);
    let text = answer(plain.path(), "inspect frames --calibration camera.toml").stdout;
    assert!(!text.contains("pinhole") && !text.contains("distortion"), "{text}");
}

#[test]
fn a_view_that_is_too_wide_is_warned_of_or_refused() {
    let folder = drive(4);
    let calibrate = |view: &str| {
        std::fs::write(folder.path().join("camera.toml"), format!("view_deg = {view}\n{FISHEYE}")).unwrap();
    };
    let run = "run frames --calibration camera.toml --height 1.5 --out out";
    calibrate("130.0");
    answer(folder.path(), run).expect(0, &["field of view of 130 degrees", "view_deg"]);
    calibrate("175.0");
    answer(folder.path(), run).expect(3, &["camera.toml", "view_deg = 1.75e2 must lie in [1, 170] degrees"]);
}
