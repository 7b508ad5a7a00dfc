use motorcade_geometry::RadialTangential;

use super::*;

pub(super) fn read(name: &str, text: &str, camera: Option<u8>) -> Result<Calibration> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    Calibration::read(&path, camera)
}

#[test]
fn kitti_projection_gives_the_camera_and_its_place_in_the_rig() {
    let text = "P0: 700 0 600 0 0 700 170 0 0 0 1 0\n\
                P3: 700 0 600 -328.8 0 700 170 2.24 0 0 1 0.002\nR0_rect: 1 0 0 0 1 0 0 0 1\n";
    let calibration = read("calib.txt", text, Some(3)).unwrap();
    assert_eq!((calibration.fx, calibration.cx, calibration.cy), (700.0, 600.0, 170.0));
    let shift = calibration.camera_from_cam0.translation();
    let expected = nalgebra::Vector3::new(-330.0 / 700.0, 1.9 / 700.0, 0.002);
    assert!((shift - expected).norm() < 1e-12, "{shift}");
    let error = read("calib.txt", text, Some(2)).unwrap_err().to_string();
    assert!(error.contains("no camera 2, only 0, 3"), "{error}");
    let error = read("calib.txt", "P0: 700 0 600\n", None).unwrap_err().to_string();
    assert!(error.contains("calib.txt:1: expected 13 columns"), "{error}");
}

#[test]
fn kitti_rows_without_names_are_cameras_0_to_3() {
    let row = |shift: f64| {
        format!("7.188e+02 0.0 6.071e+02 {shift:e} 0.0 7.188e+02 1.852e+02 0.0 0.0 0.0 1.0 0.0\n")
    };
    let text = [0.0, -386.1, 45.38, -337.2].map(row).concat();
    for (camera, shift) in [(None, 0.0), (Some(1), -386.1), (Some(2), 45.38), (Some(3), -337.2)] {
        let calibration = read("calib.txt", &text, camera).unwrap();
        assert_eq!((calibration.fx, calibration.cy, calibration.dialect), (718.8, 185.2, "KITTI"));
        assert!((calibration.camera_from_cam0.translation().x - shift / 718.8).abs() < 1e-12, "{camera:?}");
    }
    let problem = |text: &str, camera| read("calib.txt", text, camera).unwrap_err().to_string();
    assert!(problem(&row(0.0), Some(2)).contains("no camera 2, only 0"));
    assert!(problem(&row(0.0).repeat(5), None).contains("calib.txt:5: expected at most four rows"));
    let pose = "0.9 0.1 0.0 1.0 -0.1 0.9 0.0 0.0 0.0 0.0 1.0 5.0\n";
    assert!(problem(pose, None).contains("calib.txt:1: expected a projection"));
}

#[test]
fn numbers_no_lens_has_are_named() {
    let text = "fx = 700.0\nfy = 700.0\ncx = 600.0\ncy = 170.0\n";
    let problem = |from: &str, to: &str| match read("c.toml", &text.replace(from, to), None) {
        Ok(calibration) => calibration.pinhole(Path::new("c.toml"), 1242, 375).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    };
    for (from, to, name) in [
        ("fx = 700.0", "fx = 1e-300", "fx"),
        ("fx = 700.0", "fx = 1e300", "fx"),
        ("fy = 700.0", "fy = 3.0", "fy"),
        ("cx = 600.0", "cx = 1e300", "principal point"),
        ("cy = 170.0", "cy = 170.0\nfps = 1e-300", "fps"),
        ("cy = 170.0", "cy = 170.0\nheight_m = 1e300", "height_m"),
        ("cy = 170.0", "cy = 170.0\n[distortion]\nk2 = 1e300", "k2"),
        ("cy = 170.0", "cy = 170.0\nwidth = 4000000000\nheight = 375", "4000000000x375"),
    ] {
        assert!(problem(from, to).contains(name), "{to}: {}", problem(from, to));
    }
}

#[test]
fn orb_slam_and_opencv_yaml() {
    let orb = "%YAML:1.0\n---\nCamera.type: \"PinHole\"\nCamera1.fx: 458.6  # px\nCamera1.fy: 457.3\nCamera1.cx: 367.2\n\
               Camera1.cy: 248.4\nCamera1.k1: -0.28\nCamera1.p2: 1.7e-05\nCamera.width: 752\nCamera.height: 480\n\
               Camera.fps: 20.0\n";
    let calibration = read("euroc.yaml", orb, None).unwrap();
    let expected = RadialTangential { k1: -0.28, p2: 1.7e-05, ..RadialTangential::default() };
    assert_eq!((calibration.fx, calibration.distortion), (458.6, Distortion::RadialTangential(expected)));
    assert_eq!((calibration.size, calibration.fps), (Some((752, 480)), Some(20.0)));

    let opencv = "%YAML:1.0\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 7.0e+02, 0., \
                  6.0e+02, 0.,\n       7.1e+02, 1.7e+02, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   \
                  rows: 1\n   cols: 5\n   dt: d\n   data: [ 0.1, 0.2, 0.3, 0.4, 0.5 ]\n";
    let calibration = read("out.yml", opencv, None).unwrap();
    assert_eq!(
        (calibration.fx, calibration.fy, calibration.cx, calibration.cy),
        (700.0, 710.0, 600.0, 170.0)
    );
    let expected = RadialTangential { k1: 0.1, k2: 0.2, p1: 0.3, p2: 0.4, k3: 0.5 };
    assert_eq!(calibration.distortion, Distortion::RadialTangential(expected));
}

#[test]
fn ros_camera_info() {
    let text = "image_width: 640\nimage_height: 480\ncamera_name: front\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: \
                [500, 0, 320, 0, 501, 240, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  \
                cols: 5\n  data:\n  - 0.1\n  - -0.2\n  - 0\n  - 0\n  - 0.3\n";
    let calibration = read("camera.yaml", text, None).unwrap();
    assert_eq!(
        (calibration.dialect, calibration.fy, calibration.size),
        ("ROS camera_info", 501.0, Some((640, 480)))
    );
    let expected = RadialTangential { k1: 0.1, k2: -0.2, k3: 0.3, ..RadialTangential::default() };
    assert_eq!(calibration.distortion, Distortion::RadialTangential(expected));
    let unknown = text.replace("plumb_bob", "double_sphere");
    let error = read("camera.yaml", &unknown, None).unwrap_err().to_string();
    assert!(error.contains("camera.yaml:8") && error.contains("double_sphere"), "{error}");
}

#[test]
fn own_toml_refuses_what_it_does_not_know() {
    let text = "fx = 700.0\nfy = 700.0\ncx = 600.0\ncy = 170.0\nwidth = 1242\nheight = 375\n[distortion]\nk1 = -0.1\n";
    let calibration = read("c.toml", text, None).unwrap();
    let expected = RadialTangential { k1: -0.1, ..RadialTangential::default() };
    assert_eq!(calibration.distortion, Distortion::RadialTangential(expected));
    let error = calibration.pinhole(Path::new("c.toml"), 640, 480).unwrap_err().to_string();
    assert!(error.contains("1242x375") && error.contains("640x480"), "{error}");
    assert!(read("c.toml", &text.replace("k1", "k9"), None).unwrap_err().to_string().contains("k9"));
    assert!(read("c.toml", &text.replace("fx = 700.0", "fx = -1.0"), None).is_err());
    assert!(read("c.yaml", "hello: world\n", None).unwrap_err().to_string().contains("Camera.fx"));
}
