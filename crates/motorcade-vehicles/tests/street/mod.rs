//! A straight street: the camera, its road and the boxes of cars on it.

use motorcade_geometry::{Camera, Pose, Vehicle, World};
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M, Drive};
use motorcade_vehicles::{GroundFrame, image_box, size_prior, upright_pose};
use nalgebra::Vector3;

/// Camera and level road of a drive.
pub fn grounds_of(drive: &Drive, height_m: f64) -> Vec<GroundFrame> {
    let one = |(pose, time_s): (&Pose<World, Camera>, &f64)| GroundFrame {
        world_from_camera: *pose,
        up: -Vector3::y(),
        height_m,
        pitch_sigma_rad: 0.002,
        slope_change_sigma_rad: 0.0,
        road_ahead: None,
        time_s: *time_s,
    };
    drive.world_from_camera.iter().zip(&drive.times_s).map(one).collect()
}

/// A camera at this height that drives straight ahead at 10 m/s and 10 frames/s.
pub fn grounds(frames: usize, height_m: f64) -> Vec<GroundFrame> {
    grounds_of(&Drive::straight(frames, 10.0, 10.0), height_m)
}

/// The visible part of the box of a car with this pose.
pub fn outline(camera_from_vehicle: &Pose<Camera, Vehicle>) -> Option<BoundingBox> {
    let (class, size) = (VehicleClass::Car, size_prior(VehicleClass::Car).mean);
    let whole = image_box(&CAMERA, camera_from_vehicle, class, BoxConvention::VisibleExtent, &size)?;
    Some(whole.clipped(CAMERA.width, CAMERA.height))
}

pub fn detected(bbox: BoundingBox) -> Detection {
    let (class, convention) = (VehicleClass::Car, BoxConvention::VisibleExtent);
    Detection { bbox, score: 0.8, class, convention, external_id: None, pixel_size: 1.0, road_below: None }
}

/// The box of a car ahead and to the left of the camera.
pub fn car(ahead_m: f64, left_m: f64) -> Option<Detection> {
    car_below(CAMERA_HEIGHT_M, ahead_m, left_m)
}

/// The same for a camera at another height.
pub fn car_below(height_m: f64, ahead_m: f64, left_m: f64) -> Option<Detection> {
    let ground = &grounds(1, height_m)[0];
    let pose = upright_pose(&ground.point(ahead_m, left_m, 0.0), &ground.ahead(), &ground.up);
    let bbox = outline(&pose)?;
    (bbox.width() > 5.0).then(|| detected(bbox))
}
