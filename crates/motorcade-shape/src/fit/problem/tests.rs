//! Jacobians of all residuals.

use super::*;
use crate::dimensions::{Dimensions, SizePrior};
use crate::fit::ObservedKeypoint;
use crate::fit::{DOF, MAX_SHAPE};
use crate::keypoint::Layout;
use crate::prior::ShapePrior;
use motorcade_geometry::numeric::jacobian_error;
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// Every row's Jacobian against central differences, at a state where all terms are active.
#[test]
fn analytic_jacobians_match_differences() {
    let camera = PinholeCamera { fx: 720.0, fy: 700.0, cx: 620.0, cy: 180.0, width: 1242, height: 375 };
    for (layout, heading) in [(Layout::Car36, 0.3_f64), (Layout::Car14, 2.2), (Layout::Car14, -1.2)] {
        let model = Model::new(&ShapePrior::of_family(layout), MAX_SHAPE);
        let options = FitOptions::default();
        let (s, c) = heading.sin_cos();
        let rotation =
            Matrix3::from_columns(&[Vector3::new(-s, 0.1, c), Vector3::new(-c, 0.0, -s), -Vector3::y()]);
        let shape = SVector::from_fn(|b, _| 0.3 - 0.1 * b as f64);
        let state = State { camera_from_vehicle: pose(&rotation, &Vector3::new(2.0, 1.5, 11.0)), shape };
        // Pixels off the projections, every third point missing.
        let keypoints = (0..layout.count())
            .map(|i| {
                let pixel = Point2::new(700.0 + 9.0 * i as f64, 200.0 + 4.0 * (i % 5) as f64);
                ObservedKeypoint::new(pixel, if i % 3 == 0 { 0.0 } else { 0.5 })
            })
            .collect();
        let mut observation = Observation::new(keypoints, 2.0);
        observation.road = Some(MeasuredRoad::level(1.6));
        observation.size = Some(SizePrior {
            mean: Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 },
            sigma: Dimensions { length_m: 0.4, width_m: 0.1, height_m: 0.1 },
        });
        let problem = Problem::new(&model, &camera, &options, &observation, false);
        let at = |state: &State| {
            let mut rows = Vec::new();
            assert!(problem.rows(state, &mut rows));
            rows
        };
        let rows = at(&state);
        for term in [Term::Keypoint(1), Term::Road, Term::Size, Term::Shape] {
            assert!(rows.iter().any(|r| r.term == term), "{term:?}");
        }
        assert!(rows.iter().any(|r| matches!(r.term, Term::Visibility(_))));
        let analytic = DMatrix::from_fn(rows.len(), DOF, |r, k| rows[r].j[k]);
        let error = jacobian_error(&analytic, |step| {
            let moved = State {
                camera_from_vehicle: state.camera_from_vehicle.retract(&step.fixed_rows::<6>(0).into_owned()),
                shape: state.shape + step.fixed_rows::<MAX_SHAPE>(6),
            };
            Ok::<_, Infallible>(DVector::from_iterator(rows.len(), at(&moved).iter().map(|row| row.r)))
        });
        assert!(error.unwrap() < 1e-6, "{layout:?} {heading}");
    }
}
