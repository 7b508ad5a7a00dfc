//! The camera: pictures, calibration, frames of reference, pose, way.

use motorcade::{RecordedFrame, RecordedRun};
use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix6, Quaternion, Vector3};

use super::cdr::Cdr;
use super::parts::{header, pose, quaternion, vector};
use crate::frames::{CAMERA, MAP, WORLD};

/// `sensor_msgs/CompressedImage`.
pub(crate) fn image(jpeg: &[u8], time_ns: i64) -> Cdr {
    let mut out = Cdr::new();
    header(&mut out, time_ns, CAMERA);
    out.text("jpeg");
    out.bytes(jpeg);
    out
}

/// `sensor_msgs/CameraInfo` of undistorted frames.
pub(crate) fn info(camera: &PinholeCamera, time_ns: i64) -> Cdr {
    let PinholeCamera { fx, fy, cx, cy, width, height } = *camera;
    let mut out = Cdr::new();
    header(&mut out, time_ns, CAMERA);
    out.u32(height);
    out.u32(width);
    out.text("plumb_bob");
    out.length(5);
    out.f64s(&[0.0; 5]);
    out.f64s(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    out.f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    out.f64s(&[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    // Binning and region of interest: none.
    (0..6).for_each(|_| out.u32(0));
    out.bool(false);
    out
}

/// `tf2_msgs/TFMessage`.
pub(crate) fn transforms(frame: &RecordedFrame) -> Cdr {
    let mut out = Cdr::new();
    out.length(2);
    header(&mut out, frame.timestamp_ns, MAP);
    out.text(WORLD);
    vector(&mut out, &Vector3::zeros());
    quaternion(&mut out, &Quaternion::new(0.5, -0.5, 0.5, -0.5));
    header(&mut out, frame.timestamp_ns, WORLD);
    out.text(CAMERA);
    pose(&mut out, &frame.world_from_camera);
    out
}

/// `geometry_msgs/PoseWithCovarianceStamped`.
pub(crate) fn pose_with_covariance(frame: &RecordedFrame) -> Cdr {
    let mut out = Cdr::new();
    header(&mut out, frame.timestamp_ns, WORLD);
    pose(&mut out, &frame.world_from_camera);
    let covariance = in_world(frame);
    for row in 0..6 {
        (0..6).for_each(|column| out.f64(covariance[(row, column)]));
    }
    out
}

/// The covariance as ROS has it: position, then rotation, both about the axes of the world. Ours is of `[ω, ν]` in the camera.
fn in_world(frame: &RecordedFrame) -> Matrix6<f64> {
    let rotation = frame.world_from_camera.rotation_matrix();
    let mut turn = Matrix6::zeros();
    turn.fixed_view_mut::<3, 3>(0, 3).copy_from(&rotation);
    turn.fixed_view_mut::<3, 3>(3, 0).copy_from(&rotation);
    turn * frame.covariance * turn.transpose()
}

/// `nav_msgs/Path`: all poses at the time of the first.
pub(crate) fn path(run: &RecordedRun) -> Cdr {
    let mut out = Cdr::new();
    header(&mut out, run.frames.first().map_or(0, |f| f.timestamp_ns), WORLD);
    out.length(run.frames.len());
    for frame in &run.frames {
        header(&mut out, frame.timestamp_ns, WORLD);
        pose(&mut out, &frame.world_from_camera);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use nalgebra::{UnitQuaternion, Vector6};

    #[test]
    fn the_covariance_is_turned_into_the_world() {
        // Looks along the world's x axis: the camera's z axis is the world's x axis.
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let covariance = Matrix6::from_diagonal(&Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0));
        let frame = RecordedFrame {
            number: 0,
            timestamp_ns: 0,
            status: "tracked".into(),
            speed_mps: 0.0,
            speed_sigma_mps: Some(0.0),
            road_normal: -Vector3::y(),
            world_from_camera: Pose::from_parts(rotation, Vector3::zeros()),
            covariance,
        };
        let expected = Vector6::new(6.0, 5.0, 4.0, 3.0, 2.0, 1.0);
        assert!((in_world(&frame) - Matrix6::from_diagonal(&expected)).norm() < 1e-12);
    }
}
