//! The camera: calibration, frames of reference, pose, way.

use foxglove::messages::{CameraCalibration, FrameTransform, FrameTransforms, PoseInFrame, PosesInFrame};
use motorcade::{RecordedFrame, RecordedRun};
use motorcade_geometry::PinholeCamera;

use super::convert::{pose, quaternion, timestamp, vector};
use crate::frames::{CAMERA, MAP, WORLD};

pub(crate) fn calibration(camera: &PinholeCamera, frame: &RecordedFrame) -> CameraCalibration {
    let k = vec![camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0];
    let p = vec![camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    CameraCalibration {
        timestamp: Some(timestamp(frame.timestamp_ns)),
        frame_id: CAMERA.into(),
        width: camera.width,
        height: camera.height,
        k,
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p,
        ..CameraCalibration::default()
    }
}

pub(crate) fn transforms(frame: &RecordedFrame) -> FrameTransforms {
    let at = Some(timestamp(frame.timestamp_ns));
    let zero = foxglove::messages::Vector3::default();
    let turned = foxglove::messages::Quaternion { x: -0.5, y: 0.5, z: -0.5, w: 0.5 };
    let world = FrameTransform {
        timestamp: at,
        parent_frame_id: MAP.into(),
        child_frame_id: WORLD.into(),
        translation: Some(zero),
        rotation: Some(turned),
    };
    let camera = FrameTransform {
        timestamp: at,
        parent_frame_id: WORLD.into(),
        child_frame_id: CAMERA.into(),
        translation: Some(vector(&frame.world_from_camera.translation())),
        rotation: Some(quaternion(&frame.world_from_camera)),
    };
    FrameTransforms { transforms: vec![world, camera] }
}

pub(crate) fn pose_in_frame(frame: &RecordedFrame) -> PoseInFrame {
    PoseInFrame {
        timestamp: Some(timestamp(frame.timestamp_ns)),
        frame_id: WORLD.into(),
        pose: Some(pose(&frame.world_from_camera)),
    }
}

/// All poses at the time of the first.
pub(crate) fn path(run: &RecordedRun) -> PosesInFrame {
    PosesInFrame {
        timestamp: run.frames.first().map(|f| timestamp(f.timestamp_ns)),
        frame_id: WORLD.into(),
        poses: run.frames.iter().map(|f| pose(&f.world_from_camera)).collect(),
    }
}
