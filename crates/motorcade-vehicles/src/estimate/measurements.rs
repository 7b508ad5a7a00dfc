//! Pose measurements of single frames, for the graph.

use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

use super::input::TrackInput;
use super::views::Views;
use crate::box_fit::SingleView;
use crate::external::ExternalView;
use crate::ground::GroundFrame;
use crate::outline::upright_pose;
use crate::trajectory::{PoseObservation, Scaling, Source, VehicleMeasurement};

/// Measurement of a frame, all sources fused, of a vehicle with this forward direction (camera frame).
pub(super) fn fused(
    input: &TrackInput<'_>,
    views: &Views,
    frame: usize,
    forward: &Vector3<f64>,
) -> Option<VehicleMeasurement> {
    let (view, headings) = (views.in_frame(frame)?, &input.options.advanced.heading);
    let ground = input.grounds.get(frame)?;
    let camera_from_vehicle = upright_pose(&view.position_in_camera, forward, &ground.up);
    let r = camera_from_vehicle.rotation_matrix();
    let position = r.transpose() * view.covariance * r;
    let covariance = pose_covariance(&position, headings.box_sigma_rad, headings.tilt_sigma_rad);
    Some(VehicleMeasurement { camera_from_vehicle, covariance })
}

/// Measurements of each source of each frame given the track's size, with their frames, boxes first. Boxes take the headings
/// (relative to each frame's camera), external views have their own.
pub(super) fn observations(
    input: &TrackInput<'_>,
    views: &Views,
    headings: &[f64],
) -> Vec<(usize, PoseObservation)> {
    let information = views.size.information_at_scale(&input.options.advanced.size);
    let fit =
        |information: &Matrix3<f64>| input.fit_boxes(headings, &views.size.size, information, &views.boxes);
    let boxes = information.as_ref().map_or_else(Vec::new, fit);
    let of_box = |(frame, view): &(usize, SingleView)| {
        let ground = input.grounds.get(*frame)?;
        let forward = ground.direction_of(*headings.get(frame - input.start)?);
        let view = (*frame, view);
        Some((*frame, box_observation(input, views, view, information.as_ref()?, ground, &forward)?))
    };
    let of_external = |view: &ExternalView| {
        let ground = input.grounds.get(view.frame)?;
        Some((view.frame, external_observation(input, views, view, ground)))
    };
    boxes.iter().filter_map(of_box).chain(input.external.views.iter().filter_map(of_external)).collect()
}

fn box_observation(
    input: &TrackInput<'_>,
    views: &Views,
    (frame, view): (usize, &SingleView),
    size_information: &Matrix3<f64>,
    ground: &GroundFrame,
    forward: &Vector3<f64>,
) -> Option<PoseObservation> {
    let headings = &input.options.advanced.heading;
    let by_size = view.position_by_size(size_information)?;
    let scale_derivative = by_size * views.size.size.to_vector();
    let proportions = by_size * views.size.proportions() * by_size.transpose();
    let level = by_level(input, view, size_information)?;
    let common = by_common_error(input, frame, &view.position_in_camera, &proportions, level)?;
    let pose = upright_pose(&view.position_in_camera, forward, &ground.up);
    let r = pose.rotation_matrix();
    let position = r.transpose() * view.covariance * r;
    let covariance = pose_covariance(&position, headings.box_sigma_rad, headings.tilt_sigma_rad);
    // The position was fitted for this heading and depends on it.
    let mut by_heading = Matrix6::identity();
    by_heading
        .fixed_view_mut::<3, 1>(3, 2)
        .copy_from(&(r.transpose() * view.position_by_heading(size_information)?));
    Some(PoseObservation {
        source: Source::Box,
        camera_from_vehicle: pose,
        covariance: by_heading * covariance * by_heading.transpose(),
        scaling: Scaling::Size,
        scale_derivative: tangent(&(r.transpose() * scale_derivative)),
        common_derivative: tangent(&(r.transpose() * common)),
    })
}

/// Standard deviation of the distance by the level of the ground beside the own lane, as a share of it: who parks on a kerb stands there in all frames.
fn by_level(input: &TrackInput<'_>, view: &SingleView, size_information: &Matrix3<f64>) -> Option<f64> {
    let sigma_m = input.options.advanced.box_fit.level_sigma_m(view.state[1]);
    let by_road = view.position_by_road(size_information)?;
    Some(sigma_m * by_road.norm() / view.position_in_camera.coords.norm())
}

/// Derivative of a position (camera frame) by the error that all boxes and keypoints of a track share, in its standard deviations \[m\]: along the ray, by
/// the height in pixels that the networks give the vehicle too much in each frame, by its proportions of covariance `proportions` (3×3, in the
/// position), and by the level of the ground (`level`, a share of the distance).
fn by_common_error(
    input: &TrackInput<'_>,
    frame: usize,
    position_in_camera: &Point3<f64>,
    proportions: &Matrix3<f64>,
    level: f64,
) -> Option<Vector3<f64>> {
    let boxes = &input.track.boxes;
    let observed = &boxes[boxes.binary_search_by_key(&frame, |b| b.frame).ok()?].observed;
    let position = position_in_camera.coords;
    let height_px = observed.bbox.height().max(observed.pixel_size);
    let of_box = input.options.advanced.box_fit.common_height_sigma_px * observed.pixel_size / height_px;
    let of_proportions = position.dot(&(proportions * position)).max(0.0).sqrt() / position.norm_squared();
    Some(-position * of_box.hypot(of_proportions).hypot(level))
}

fn external_observation(
    input: &TrackInput<'_>,
    views: &Views,
    view: &ExternalView,
    ground: &GroundFrame,
) -> PoseObservation {
    let size = views.size.size.to_vector();
    let (position, scaling, scale_derivative, covariance) = match view.size_dependence {
        Some(by) => {
            let proportions = by.slope * views.size.proportions() * by.slope.transpose();
            let shift = by.slope * (size - by.size.to_vector());
            let position = view.position_in_camera + shift;
            (position, Scaling::Size, by.slope * size, by.covariance + proportions)
        }
        None if view.scale_sigma > 0.0 => {
            let (position, sigma) = (view.position_in_camera, view.scale_sigma);
            let own = view.covariance - position.coords * position.coords.transpose() * sigma.powi(2);
            (position, Scaling::Source { sigma }, position.coords, own)
        }
        None => (view.position_in_camera, Scaling::Size, Vector3::zeros(), view.covariance),
    };
    let proportions = view
        .size_dependence
        .map_or_else(Matrix3::zeros, |by| by.slope * views.size.proportions() * by.slope.transpose());
    // A pose of a file has the error of its source.
    let own = (view.source == Source::Keypoints).then_some(view.frame);
    let level = |frame: usize| {
        let information = views.size.information_at_scale(&input.options.advanced.size)?;
        let at = views.boxes.binary_search_by_key(&frame, |(frame, _)| *frame).ok()?;
        by_level(input, &views.boxes[at].1, &information)
    };
    let common = |frame: usize| {
        by_common_error(input, frame, &position, &proportions, level(frame).unwrap_or_default())
    };
    let common = own.and_then(common).unwrap_or_default();
    let pose = upright_pose(&position, &view.forward_in_camera, &ground.up);
    let r = pose.rotation_matrix();
    let tilt_sigma_rad = input.options.advanced.heading.tilt_sigma_rad;
    PoseObservation {
        source: view.source,
        camera_from_vehicle: pose,
        covariance: pose_covariance(
            &(r.transpose() * covariance * r),
            view.heading_sigma_rad,
            tilt_sigma_rad,
        ),
        scaling,
        scale_derivative: tangent(&(r.transpose() * scale_derivative)),
        common_derivative: tangent(&(r.transpose() * common)),
    }
}

/// Covariance (6×6 `[ω, ν]`) of an upright vehicle from that of its position (3×3, vehicle frame).
fn pose_covariance(position: &Matrix3<f64>, heading_sigma_rad: f64, tilt_sigma_rad: f64) -> Matrix6<f64> {
    let mut covariance = Matrix6::zeros();
    covariance[(0, 0)] = tilt_sigma_rad * tilt_sigma_rad;
    covariance[(1, 1)] = tilt_sigma_rad * tilt_sigma_rad;
    covariance[(2, 2)] = heading_sigma_rad * heading_sigma_rad;
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(position);
    covariance
}

/// Derivative of a position (vehicle frame) as that of the tangent `[ω, ν]`.
fn tangent(slope: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(0.0, 0.0, 0.0, slope.x, slope.y, slope.z)
}
