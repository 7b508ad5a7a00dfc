//! Fits to exact, occluded and truncated boxes.

use super::*;
use crate::outline::{image_box, upright_pose};
use crate::size_prior::size_prior;
use motorcade_geometry::numeric::jacobian_error;
use motorcade_geometry::{Pose, mahalanobis_squared};
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
use motorcade_testing::CAMERA;
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

pub(super) fn ground() -> GroundFrame {
    let up = Vector3::new(0.01, -1.0, 0.01).normalize();
    GroundFrame {
        world_from_camera: Pose::identity(),
        up,
        height_m: 1.65,
        pitch_sigma_rad: 1e-3,
        slope_change_sigma_rad: 0.0,
        road_ahead: None,
        time_s: 0.0,
    }
}

fn observe(detection: &Detection) -> ObservedBox {
    ObservedBox::new(detection, &CAMERA, &[], &BoxFitOptions::default())
}

fn locate(observed: &ObservedBox, heading_rad: f64, prior: &SizePrior) -> Option<SingleView> {
    let options = BoxFitOptions::default();
    BoxFit { camera: &CAMERA, ground: &ground(), options: &options }.locate(observed, heading_rad, prior)
}

fn car(bbox: BoundingBox) -> Detection {
    Detection {
        class: VehicleClass::Car,
        score: 1.0,
        bbox,
        convention: BoxConvention::VisibleExtent,
        external_id: None,
        pixel_size: 1.0,
        road_below: None,
    }
}

fn coordinates(view: &SingleView) -> DVector<f64> {
    DVector::from_column_slice(view.position_in_camera.coords.as_slice())
}

#[test]
fn exact_boxes_give_exact_positions() {
    let prior = size_prior(VehicleClass::Car);
    for (ahead, left, heading) in [(12.0, -3.0, 0.0), (25.0, 4.0, 3.0), (8.0, -4.5, 0.2), (40.0, 1.0, 0.0)] {
        let truth = ground().point(ahead, left, 0.0);
        let pose = upright_pose(&truth, &ground().direction_of(heading), &ground().up);
        for convention in [BoxConvention::VisibleExtent, BoxConvention::ProjectedCuboid] {
            let bbox = image_box(&CAMERA, &pose, VehicleClass::Car, convention, &prior.mean).unwrap();
            let observed = observe(&Detection { convention, ..car(bbox) });
            let found = locate(&observed, heading, &prior).unwrap();
            let error = (found.position_in_camera - truth).norm();
            assert!(error < 0.02 * ahead, "{convention:?} {ahead} {left}: {error}");
            assert!(found.covariance.symmetric_eigenvalues().min() > 0.0);
        }
    }
}

#[test]
fn derivative_by_size_matches_differences() {
    // The size is held tightly at its true value and at neighbouring ones.
    let size = Vector3::new(4.2, 1.7, 1.5);
    let pose = upright_pose(&ground().point(18.0, -2.5, 0.0), &ground().direction_of(0.5), &ground().up);
    let bbox = image_box(
        &CAMERA,
        &pose,
        VehicleClass::Car,
        BoxConvention::VisibleExtent,
        &Dimensions::from_vector(&size),
    )
    .unwrap();
    let observed = observe(&car(bbox));
    let held = |size: &Vector3<f64>| {
        let sigma = Dimensions::from_vector(&Vector3::repeat(1e-5));
        let prior = SizePrior { mean: Dimensions::from_vector(size), sigma };
        locate(&observed, 0.5, &prior).unwrap()
    };
    let slope = held(&size).position_by_size(&(Matrix3::identity() * 1e10)).unwrap();
    // In steps of a millimetre: the fit has converged to micrometres.
    let analytic = DMatrix::from_iterator(3, 3, (slope * 1e3).iter().copied());
    let error = jacobian_error(&analytic, |step| {
        Ok::<_, Infallible>(coordinates(&held(&(size + step.fixed_rows::<3>(0) * 1e3))))
    });
    assert!(error.unwrap() < 0.01);
    // A higher car with the same box is further away.
    assert!(slope[(2, 2)] > 2.5, "{slope}");
}

#[test]
fn derivative_by_heading_matches_differences() {
    let prior = size_prior(VehicleClass::Car);
    let information = Matrix3::identity() * 1e6;
    let pose = upright_pose(&ground().point(18.0, -2.5, 0.0), &ground().direction_of(0.1), &ground().up);
    let bbox =
        image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean).unwrap();
    let observed = observe(&car(bbox));
    let at = |heading: f64| {
        let (ground, options) = (ground(), BoxFitOptions::default());
        let fit = BoxFit { camera: &CAMERA, ground: &ground, options: &options };
        fit.locate_sized(&observed, heading, (&prior.mean, &information), None).unwrap()
    };
    let slope = at(0.1).position_by_heading(&information).unwrap();
    // In steps of a milliradian, as above.
    let analytic = DMatrix::from_iterator(3, 1, (slope * 1e3).iter().copied());
    let error = jacobian_error(&analytic, |step| Ok::<_, Infallible>(coordinates(&at(0.1 + 1e3 * step[0]))));
    assert!(error.unwrap() < 0.05);
    // Turned further it shows more of its side: a box of the same width is then further away.
    assert!(slope.z > 5.0, "{slope}");
}

/// Also where the noise depends on the state: a half-hidden edge weighs less on the side where the vehicle may end.
#[test]
fn an_earlier_fit_is_a_start_and_nothing_else() {
    let prior = size_prior(VehicleClass::Car);
    let (ground, options) = (ground(), BoxFitOptions::default());
    let fit = BoxFit { camera: &CAMERA, ground: &ground, options: &options };
    for (ahead, left) in [(12.0, -2.5), (18.0, 3.0), (40.0, -6.0)] {
        let truth = ground.point(ahead, left, 0.0);
        let pose = upright_pose(&truth, &ground.direction_of(0.1), &ground.up);
        let bbox =
            image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean).unwrap();
        for edges in [[true; 4], [false, true, true, true], [true, true, true, false]] {
            let observed = ObservedBox { edges, ..observe(&car(bbox)) };
            let located = |heading: f64, earlier: Option<&SingleView>| {
                fit.locate_sized(&observed, heading, (&prior.mean, &prior.information()), earlier).unwrap()
            };
            let alone = located(0.1, None);
            let from_another = located(0.1, Some(&located(0.9, None)));
            let off_m = (alone.position_in_camera - from_another.position_in_camera).norm();
            assert!(off_m < 0.02, "{ahead} m ahead, {edges:?}: {off_m} m");
        }
    }
}

/// Hidden at both sides it may be a little aside, but not on the other side of the road, where no box would be.
#[test]
fn hidden_sides_keep_a_vehicle_near_its_box() {
    let prior = size_prior(VehicleClass::Car);
    for (ahead, left) in [(31.0, 21.0), (27.0, 20.0), (36.0, 24.0), (20.0, -12.0)] {
        let truth = ground().point(ahead, left, 0.0);
        let pose = upright_pose(&truth, &ground().direction_of(0.07), &ground().up);
        let bbox =
            image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean).unwrap();
        for (edges, jitter_px) in [([false, true, false, true], 2.0), ([false, true, true, true], -2.0)] {
            let b = bbox.to_array();
            let moved = BoundingBox::new([b[0], b[1] - jitter_px, b[2], b[3] + 0.5 * jitter_px]);
            let observed = ObservedBox { edges, ..observe(&car(moved)) };
            let found = locate(&observed, 0.07, &prior).unwrap();
            let error = (found.position_in_camera - truth).norm();
            assert!(error < 0.25 * ahead, "{ahead} {left} {edges:?}: {error}");
        }
    }
}

/// With the bottom occluded, the roof, as high as the camera, hardly constrains the distance.
#[test]
fn an_occluded_bottom_edge_bounds_the_depth() {
    let prior = size_prior(VehicleClass::Car);
    for ahead in [12.0, 25.0, 45.0] {
        let truth = ground().point(ahead, -3.0, 0.0);
        let pose = upright_pose(&truth, &ground().direction_of(0.0), &ground().up);
        let whole =
            image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean).unwrap();
        for occluded in [0.0, 0.2, 0.4] {
            let bbox = BoundingBox { y2: whole.y2 - occluded * whole.height(), ..whole };
            for edges in [[true, true, true, false], [true, true, false, false], [false, true, true, false]] {
                let observed = ObservedBox {
                    bbox,
                    class: VehicleClass::Car,
                    convention: BoxConvention::VisibleExtent,
                    edges,
                    pixel_size: 1.0,
                    road_below: None,
                };
                let found = locate(&observed, 0.0, &prior).unwrap();
                let error = (found.position_in_camera - truth).norm() / ahead;
                assert!(error < 0.1 + occluded, "{ahead} m, {occluded} occluded, {edges:?}: {error}");
            }
        }
    }
    // Truncated at two borders beside the camera: near, or no solution.
    let bbox = BoundingBox { x1: 0.0, y1: 160.0, x2: 204.0, y2: 374.0 };
    let observed = observe(&car(bbox));
    let found = locate(&observed, 0.0, &prior);
    assert!(found.is_none_or(|f| f.position_in_camera.z < 9.0), "{found:?}");
}

/// A car that leaves the image at the left: its bonnet is lower than its roof, and its tyres are out of the image.
#[test]
fn a_truncated_car_is_not_a_small_car() {
    let prior = size_prior(VehicleClass::Car);
    for left in [7.0, 7.5, 8.0] {
        let truth = ground().point(9.0, left, 0.0);
        let pose = upright_pose(&truth, &ground().direction_of(0.0), &ground().up);
        let whole =
            image_box(&CAMERA, &pose, VehicleClass::Car, BoxConvention::VisibleExtent, &prior.mean).unwrap();
        let (top, bottom) = (whole.y1 + 0.25 * whole.height(), whole.y2 - 0.15 * whole.height());
        let bbox = BoundingBox { x1: 0.0, y1: top, y2: bottom, ..whole };
        let observed = observe(&car(bbox));
        assert_eq!(observed.edges, [false, true, true, true]);
        let found = locate(&observed, 0.0, &prior).unwrap();
        let off = found.position_in_camera - truth;
        let sigmas = mahalanobis_squared(&off, &found.covariance).unwrap().sqrt();
        assert!(off.norm() < 2.6 && sigmas < 2.0, "{left}: {off}, {sigmas} standard deviations");
    }
}
