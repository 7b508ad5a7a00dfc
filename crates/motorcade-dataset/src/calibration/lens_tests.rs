//! Lenses by the names and places of each format.

use motorcade_geometry::{Fisheye, RadialTangential, Rational};

use super::tests::read;
use super::*;

const K: &str = "[285, 0, 420, 0, 286, 400, 0, 0, 1]";
const FISHEYE: Distortion = Distortion::Fisheye(Fisheye { k1: 0.1, k2: -0.2, k3: 0.3, k4: -0.4 });
const RATIONAL: Distortion =
    Distortion::Rational(Rational { k1: 0.1, k2: 0.2, p1: 0.3, p2: 0.4, k3: 0.5, k4: 0.6, k5: 0.7, k6: 0.8 });

fn lens(text: &str) -> Distortion {
    read("camera.yaml", text, None).unwrap().distortion
}

fn problem(text: &str) -> String {
    read("camera.yaml", text, None).unwrap_err().to_string()
}

fn opencv(before: &str, coefficients: &str) -> String {
    format!(
        "%YAML:1.0\n---\n{before}camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {K}\n\
         distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n   data: {coefficients}\n"
    )
}

#[test]
fn opencv_coefficients_name_the_model() {
    let four = "[0.1, -0.2, 0.3, -0.4]";
    let plain = RadialTangential { k1: 0.1, k2: -0.2, p1: 0.3, p2: -0.4, k3: 0.0 };
    assert_eq!(lens(&opencv("", four)), Distortion::RadialTangential(plain));
    assert_eq!(lens(&opencv("fisheye_model: 0\n", four)), Distortion::RadialTangential(plain));
    for named in [
        "fisheye_model: 1\n",
        "camera_model: fisheye\n",
        "distortion_model: equidistant\n",
        "camera_model: pinhole\ndistortion_model: \"equidistant\"\n",
    ] {
        assert_eq!(lens(&opencv(named, four)), FISHEYE, "{named}");
    }
    assert_eq!(lens(&opencv("", "[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]")), RATIONAL);
    // OpenCV fills up with zeros.
    let zeros = lens(&opencv("", "[0.1, -0.2, 0.3, -0.4, 0., 0., 0., 0., 0., 0., 0., 0., 0., 0.]"));
    assert_eq!(zeros, Distortion::RadialTangential(plain));
    let aliased = opencv("", four).replace("distortion_coefficients", "dist_coeffs");
    assert_eq!(lens(&aliased), Distortion::RadialTangential(plain));
}

#[test]
fn more_than_a_model_takes_is_refused() {
    let prism = "[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.01, 0, 0, 0]";
    assert!(problem(&opencv("", prism)).contains("thin-prism"), "{}", problem(&opencv("", prism)));
    let fisheye = |d| problem(&opencv("camera_model: fisheye\n", d));
    assert!(fisheye("[0.1, 0.2]").contains("found 2 coefficients"));
    assert!(fisheye("[0.1, 0.2, 0.3, 0.4, 0.5]").contains("k1 k2 k3 k4, found 5"));
    let five = problem(&opencv("distortion_model: plumb_bob\n", "[0, 0, 0, 0, 0, 0.1]"));
    assert!(five.contains("k1 k2 p1 p2 k3, found 6"), "{five}");
    let both = problem(&opencv("camera_model: fisheye\ndistortion_model: plumb_bob\n", "[0, 0, 0, 0]"));
    assert!(both.contains("camera.yaml:4: expected one model"), "{both}");
    let skewed = opencv("fisheye_model: 1\n", "[0, 0, 0, 0]").replace("[285, 0,", "[285, 3,");
    assert!(problem(&skewed).contains("skew of 3 px"), "{}", problem(&skewed));
    assert!(problem(&opencv("fisheye_model: 1\n", "[0, 0, 0, .nan]")).contains("list of numbers"));
    assert!(problem(&opencv("fisheye_model: 1\n", "[0, 0, 0, nan]")).contains("k4"));
}

#[test]
fn ros_models() {
    let ros = |model: &str, d: &str| {
        format!(
            "image_width: 848\nimage_height: 800\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: {K}\ndistortion_model: {model}\n\
             distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: {d}\n"
        )
    };
    // The driver of the T265 writes a fifth coefficient, 0.
    assert_eq!(lens(&ros("equidistant", "[0.1, -0.2, 0.3, -0.4, 0.0]")), FISHEYE);
    assert_eq!(lens(&ros("rational_polynomial", "[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]")), RATIONAL);
    let unknown = problem(&ros("fov", "[0.9]"));
    assert!(unknown.contains("camera.yaml:7") && unknown.contains("`fov`"), "{unknown}");
    // `ros2 topic echo`.
    let message = "header:\n  stamp:\n    sec: 1\nheight: 800\nwidth: 848\ndistortion_model: rational_polynomial\nd:\n- 0.1\n- 0.2\n\
                   - 0.3\n- 0.4\n- 0.5\n- 0.6\n- 0.7\n- 0.8\nk:\n- 285.0\n- 0.0\n- 420.0\n- 0.0\n- 286.0\n- 400.0\n- 0.0\n- 0.0\n- 1.0\n";
    let read = read("camera.yaml", message, None).unwrap();
    assert_eq!((read.distortion, read.fy, read.size), (RATIONAL, 286.0, Some((848, 800))));
}

#[test]
fn orb_slam_kannala_brandt() {
    let orb = |kind: &str, lens: &str| {
        format!(
            "%YAML:1.0\n---\nFile.version: \"1.0\"\nCamera.type: \"{kind}\"\nCamera1.fx: 285.0\nCamera1.fy: 286.0\nCamera1.cx: 420.0\n\
             Camera1.cy: 400.0\n{lens}Camera.width: 848\nCamera.height: 800\n"
        )
    };
    let four = "Camera1.k1: 0.1\nCamera1.k2: -0.2\nCamera1.k3: 0.3\nCamera1.k4: -0.4\n";
    assert_eq!(lens(&orb("KannalaBrandt8", four)), FISHEYE);
    let three = four.replace("Camera1.k4", "Camera2.k4");
    assert!(problem(&orb("KannalaBrandt8", &three)).contains("no Camera1.k4"));
    assert!(problem(&orb("PinHole", four)).contains("Camera1.k4 is no coefficient"));
    assert!(problem(&orb("KannalaBrandt8", &format!("{four}Camera1.p1: 0.1\n"))).contains("Camera1.p1"));
    assert!(problem(&orb("Omni", four)).contains("`Omni`"));
    let stella = "Camera:\n  name: \"x\"\n  model: \"fisheye\"\n  fx: 285.0\n  fy: 286.0\n  cx: 420.0\n  cy: 400.0\n  k1: 0.1\n  k2: \
                  -0.2\n  k3: 0.3\n  k4: -0.4\n  cols: 848\n";
    assert_eq!(lens(stella), FISHEYE);
}

const CAMCHAIN: &str = "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [0.1, -0.2, 0.3, -0.4]\n  \
                        distortion_model: equidistant\n  intrinsics: [285.0, 286.0, 420.0, 400.0]\n  resolution: [848, 800]\n  rostopic: \
                        /cam0\ncam1:\n  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, 0.1]\n  - [0.0, 1.0, 0.0, 0.0]\n  camera_model: pinhole\n  \
                        distortion_coeffs: [0.1, -0.2, 0.3, -0.4]\n  distortion_model: radtan\n  intrinsics: [385.0, 386.0, 420.0, \
                        400.0]\n  resolution: [752, 480]\n";

#[test]
fn kalibr_cameras_are_chosen() {
    let first = read("camchain.yaml", CAMCHAIN, None).unwrap();
    assert_eq!((first.dialect, first.fy, first.cx), ("Kalibr", 286.0, 420.0));
    assert_eq!((first.distortion, first.size), (FISHEYE, Some((848, 800))));
    let second = read("camchain.yaml", CAMCHAIN, Some(1)).unwrap();
    let plain = RadialTangential { k1: 0.1, k2: -0.2, p1: 0.3, p2: -0.4, k3: 0.0 };
    assert_eq!((second.distortion, second.fx), (Distortion::RadialTangential(plain), 385.0));
    let missing = read("camchain.yaml", CAMCHAIN, Some(2)).unwrap_err().to_string();
    assert!(missing.contains("no cam2, only cam0, cam1"), "{missing}");
    for model in ["omni", "eucm", "ds"] {
        // These have intrinsics of their own besides.
        let other = CAMCHAIN.replace("pinhole", model).replace("[285.0", "[1.5, 285.0");
        assert!(problem(&other).contains(&format!("`{model}`")), "{}", problem(&other));
    }
    assert!(problem(&CAMCHAIN.replace("286.0, 420.0", "286.0")).contains("has 3 numbers, expected 4"));
    let sensor = "sensor_type: camera\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458.6, 457.3, 367.2, \
                  248.4]\ndistortion_model: radial-tangential\ndistortion_coefficients: [0.1, -0.2, 0.3, -0.4]\n";
    let sensor = read("sensor.yaml", sensor, None).unwrap();
    assert_eq!((sensor.distortion, sensor.fps), (Distortion::RadialTangential(plain), Some(20.0)));
}

#[test]
fn own_toml_names_the_model() {
    let toml =
        |rest: &str| read("c.toml", &format!("fx = 285.0\nfy = 286.0\ncx = 420.0\ncy = 400.0\n{rest}"), None);
    let problem = |rest: &str| toml(rest).unwrap_err().to_string();
    let fisheye = "[distortion]\nmodel = \"fisheye\"\nk1 = 0.1\nk2 = -0.2\nk3 = 0.3\nk4 = -0.4\n";
    let read = toml(&format!("view_deg = 90.0\n{fisheye}")).unwrap();
    assert_eq!((read.distortion, read.view_deg), (FISHEYE, Some(90.0)));
    let rational = "[distortion]\nmodel = \"rational\"\nk1 = 0.1\nk2 = 0.2\np1 = 0.3\np2 = 0.4\nk3 = 0.5\nk4 = 0.6\nk5 = 0.7\nk6 = 0.8\n";
    assert_eq!(toml(rational).unwrap().distortion, RATIONAL);
    assert!(
        problem("[distortion]\nk4 = 0.0\n")
            .contains("k4 is no coefficient of the model \"radial-tangential\"")
    );
    assert!(
        problem(&format!("{fisheye}p1 = 0.0\n")).contains("p1 is no coefficient of the model \"fisheye\"")
    );
    assert!(problem(&fisheye.replace("fisheye", "omni")).contains("omni"));
    assert!(problem(&fisheye.replace("-0.4", "nan")).contains("k4"));
    assert!(problem(&fisheye.replace("0.1", "-300.0")).contains("turns back"));
    for view in ["0.0", "179.0", "nan", "-90.0"] {
        assert!(problem(&format!("view_deg = {view}\n{fisheye}")).contains("view_deg"), "{view}");
    }
}

#[test]
fn fingerprints_of_radial_tangential_calibrations_stay() {
    let euroc = "Camera1.fx: 458.6\nCamera1.fy: 457.3\nCamera1.cx: 367.2\nCamera1.cy: 248.4\nCamera1.k1: -0.28\nCamera1.k2: 0.07\n\
                 Camera1.p2: 1.7e-05\nCamera.width: 752\nCamera.height: 480\nCamera.fps: 20.0\n";
    // As version 0.1 printed it before there were other lenses (commit 08b342c).
    let expected = "Calibration { dialect: \"OpenCV YAML\", fx: 458.6, fy: 457.3, cx: 367.2, cy: 248.4, size: Some((752, 480)), \
                    distortion: Distortion { k1: -0.28, k2: 0.07, p1: 0.0, p2: 1.7e-5, k3: 0.0 }, fps: Some(20.0), height_m: None, \
                    camera_from_cam0: camera_from_cam0 Isometry { rotation: [0.0, 0.0, 0.0, 1.0], translation: [0.0, 0.0, 0.0] } }";
    assert_eq!(read("euroc.yaml", euroc, None).unwrap().identity(), expected);
}
