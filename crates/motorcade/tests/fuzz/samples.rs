//! Valid files of every kind that is read, made here.

use std::io::Cursor;

use image::{DynamicImage, GrayImage, ImageFormat, Luma};
use motorcade::Config;

pub const CAMERA_TOML: &str = "fx = 50.0\nfy = 50.0\ncx = 31.5\ncy = 23.5\nwidth = 64\nheight = 48\n[distortion]\nk1 = -0.2\nk2 = 0.03\n";
pub const OPENCV_YAML: &str = "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   \
    data: [ 50., 0., 31.5, 0., 50., 23.5, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ -0.2, 0.03, 0., 0., 0. ]\n";
pub const KALIBR_YAML: &str = "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0.1, -0.2, 0.3, -0.4]\n  distortion_model: equidistant\n  intrinsics: [28.0, 28.5, \
    31.0, 24.0]\n  resolution: [64, 48]\n  rostopic: /cam0\n";
pub const ORB_YAML: &str = "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 50.0\nCamera.fy: 50.0\nCamera.cx: 31.5\nCamera.cy: 23.5\nCamera.k1: -0.2\nCamera.width: 64\nCamera.height: 48\n";
pub const KITTI_CALIB: &str = "P0: 700 0 600 0 0 700 170 0 0 0 1 0\nP2: 700 0 600 40 0 700 170 0.2 0 0 1 0.003\nR_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 0 -1 0 0 0 0 -1 0 1 0 0 0\n";
pub const LABELS: &str = "0 3 Car 0 1 -1.57 120.5 170 220.25 240 1.5 1.6 3.9 -2.5 1.65 14.2 -1.6\n1 -1 DontCare -1 -1 -10 10 20 30 40 -1 -1 -1 -1000 -1000 -1000 -10\n1 4 Van 0.1 \
    2 0.3 1 2 300 200 2.1 1.9 5 3 1.7 22 1.5 0.93\n";
pub const MOT: &str = "1,1,100,150,60,40,0.9,-1,-1,-1\n2,1,102,150,61,41,0.8,-1,-1,-1\n";
pub const BOXES_CSV: &str = "0,100.5,150,160,190,0.9\n1,101,150,161,191,0.8\n";
pub const KEYPOINTS: &str = "frame,track_id,layout,index,x_px,y_px,confidence\n0,1,car-14,0,100.5,150.25,0.9\n0,1,car-14,3,120,151,0.5\n2,1,car-36,35,90,80,1\n";
pub const TUM: &str = "# time tx ty tz qx qy qz qw\n0.0 0 0 0 0 0 0 1\n0.1 0.01 0 0.9 0 0.001 0 1\n0.2 0.02 0 1.8 0 0.002 0 1\n";
pub const KITTI_POSES: &str =
    "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.01 0 1 0 0 0 0 1 0.9\n1 0 0 0.02 0 1 0 0 0 0 1 1.8\n";
pub const VEHICLE_POSES: &str = "seq,frame,track_id,tx,ty,tz,R02,R00\n3,10,0,4.13,1.29,8.97,-0.097,0.995\n3,11,0,4.1,1.29,9.5,-0.09,0.996\n";
pub const SPEEDS: &str = "time,speed_mps\n0.0,8.5\n0.5,8.7\n1.0,9\n";
pub const GPX: &str = "<?xml version=\"1.0\"?>\n<gpx version=\"1.1\"><trk><trkseg><trkpt lat=\"47.37\" lon=\"8.54\"><ele>410</ele><time>2024-05-01T10:00:00Z</time></trkpt>\
    <trkpt lat=\"47.3701\" lon=\"8.5401\"><time>2024-05-01T10:00:01.5Z</time></trkpt></trkseg></trk></gpx>\n";
pub const NMEA: &str = "$GPGGA,100000.00,4722.2000,N,00832.4000,E,1,08,0.9,410.0,M,48.0,M,,*69\n$GPRMC,100001.00,A,4722.2010,N,00832.4010,E,16.0,84.0,010524,,,A*5B\n$GPRMC,100002.00,A,4722.2020,N,00832.4020,E,16.0,84.0,010524,,,A*58\n";
pub const GPS_CSV: &str =
    "time,latitude,longitude,altitude,sigma_m\n0,47.37,8.54,410,2\n1,47.3701,8.5401,410,2\n";
pub const G2O: &str = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\nFIX 0\nEDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 100 0 0 0 0 0 100 0 0 0 0 100 0 0 0 400 0 0 400 0 400\n";
pub const MODELS: &str = "[[model]]\nname = \"a\"\nfile = \"a.onnx\"\nlicence = \"MIT\"\ninput = { colour = \"rgb\", resize = \"stretch\", scale = 0.0039 }\noutput = { kind = \"scene\", \
    road = true, edge_errors = [ { height = 10.0, top = -1.9 }, { height = 26.5 } ] }\n";
pub const TINY_MODEL: &str = "[[model]]\nname = \"tiny\"\nfile = \"tiny.onnx\"\nlicence = \"MIT\"\ninput = { colour = \"rgb\", resize = \"stretch\" }\noutput = { kind = \"segmentation\", road = [1] }\n";
pub const PERCEPTION: &str = "{\"motorcade_perception\":1,\"vehicles\":\"network a\",\"road\":\"none\",\"keypoints\":\"none\"}\n{\"frame\":0,\"detections\":[{\"class\":\"Car\",\"score\":0.8,\
    \"bbox\":{\"x1\":1.0,\"y1\":2.0,\"x2\":30.0,\"y2\":20.0},\"convention\":\"visible_extent\",\"external_id\":null,\"pixel_size\":1.5}],\"road\":null,\"keypoints\":[]}\n";
pub const RECORD: &str = "{\"motorcade\":\"0.1.0\",\"command\":[\"motorcade\",\"run\"],\"fingerprint\":\"0123456789abcdef\",\"interrupted\":false,\"files\":[{\"name\":\"ego.tum\",\"bytes\":12}],\
    \"warnings\":[],\"camera_height_m\":1.65,\"counters\":{\"frames\":3},\"input\":{\"format\":\"images\"}}\n";

/// All settings as `motorcade config` prints them.
pub fn config() -> String {
    Config::default().to_commented_toml()
}

/// A configuration without comments and empty lines.
pub fn without_comments(config: &str) -> String {
    config
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(|line| format!("{line}\n"))
        .collect()
}

/// Each table of a configuration by itself.
pub fn tables(config: &str) -> Vec<String> {
    config.split("\n[").skip(1).map(|table| format!("[{table}\n")).collect()
}

/// The same picture in each format.
pub fn pictures() -> Vec<Vec<u8>> {
    let grey = GrayImage::from_fn(24, 16, |x, y| Luma([(x * 9 + y * 5) as u8]));
    let picture = DynamicImage::from(grey).into_rgb8();
    let formats =
        [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP, ImageFormat::Bmp, ImageFormat::Tiff];
    let encode = |format| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    formats.map(encode).to_vec()
}
