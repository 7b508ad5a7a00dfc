//! The road plane from pixels: direct alignment of the road between two frames by the homography a plane induces.
//!
//! With the camera motion R, t from the current to the reference frame known up to scale and the road `mᵀX = 1` in the
//! current camera frame (m = −n/d: n the unit normal towards the camera, d the camera's height in the odometry's unit),
//! a road pixel moves by `x' ~ K (R + t mᵀ) K⁻¹ x`. The three numbers of m are found by Gauss–Newton on the grey values
//! of all textured road pixels; the metric scale of the odometry is then `h·|m|`. A small rotation with a prior stands
//! for the error of the odometry's own rotation.

use motorcade_geometry::robust::sigma_from_absolute;
use nalgebra::{Matrix4, Point2, Vector3};

use super::normal_equations::{KEPT, State, accumulate, add_priors};
use super::options::RoadOptions;
use super::plane::AlignedRoad;
use super::view::{RoadScratch, RoadView};

/// Aligns the road. `None` when there is too little texture or too few pixels agree with the plane.
pub fn align_road(
    view: &RoadView<'_>,
    usable: impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<AlignedRoad> {
    if !options.free_normal {
        return align_level_road(view, &usable, options, scratch);
    }
    align(view, &usable, options, scratch)
}

/// With the normal held, eq. (1): a level guess with a tilt prior that holds it.
fn align_level_road(
    view: &RoadView<'_>,
    usable: &impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<AlignedRoad> {
    let level = RoadView { guess: Vector3::new(0.0, view.guess.norm(), 0.0), ..*view };
    let mut options = *options;
    options.advanced.alignment.tilt_sigma_rad = options.advanced.alignment.held_tilt_sigma_rad;
    align(&level, usable, &options, scratch)
}

fn align(
    view: &RoadView<'_>,
    usable: &impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<AlignedRoad> {
    let mut state = State { m: view.guess, turn: Vector3::zeros(), gain: 0.0, offset: 0.0, curvature: 0.0 };
    let mut result = None;
    for level in (0..options.advanced.alignment.levels.min(view.current.len())).rev() {
        view.samples(level, usable, options, &mut scratch.samples);
        if scratch.samples.len() < options.advanced.alignment.least_pixels {
            return None;
        }
        result = refine(view, scratch, level, &mut state, options);
        result.as_ref()?;
    }
    result
}

fn refine(
    view: &RoadView<'_>,
    RoadScratch { samples, absolute }: &mut RoadScratch,
    level: usize,
    state: &mut State,
    options: &RoadOptions,
) -> Option<AlignedRoad> {
    let alignment = &options.advanced.alignment;
    // Estimated after every iteration.
    let mut sigma = alignment.initial_sigma_grey;
    let mut last = None;
    for _ in 0..alignment.iterations {
        let (mut h, mut g) = accumulate(view, samples, level, state, sigma, alignment, absolute);
        let pixels = absolute.len();
        if pixels < alignment.least_pixels {
            return None;
        }
        add_priors(&mut h, &mut g, view, state, sigma, options);
        let step = h.cholesky()?.solve(&-g);
        state.m += step.fixed_rows::<3>(0);
        state.turn += step.fixed_rows::<3>(3);
        state.gain += step[6];
        state.offset += step[7];
        state.curvature += step[8];
        let limit = alignment.agreement_sigmas * sigma.max(alignment.agreement_sigma_grey);
        let agreement = absolute.iter().filter(|r| **r < limit).count() as f64 / samples.len() as f64;
        sigma = sigma_from_absolute(absolute)?.max(alignment.least_sigma_grey);
        let whole = h.try_inverse()? * (sigma * sigma * alignment.correlated_pixels);
        let plane = AlignedRoad {
            m: state.m,
            curvature: state.curvature,
            covariance: Matrix4::from_fn(|r, c| whole[(KEPT[r], KEPT[c])]),
            prior_curvature_sigma: options.curvature_sigma,
            pixels,
            agreement,
            sigma_grey: sigma,
        };
        let converged = step.fixed_rows::<3>(0).norm() < alignment.converged * state.m.norm();
        last = Some(plane);
        if converged {
            break;
        }
    }
    // A plane above the camera, behind it or far from the guess is not the road.
    let sane = state.m.iter().all(|v| v.is_finite())
        && state.m.angle(&view.guess) < alignment.tilt_gate * alignment.tilt_sigma_rad;
    last.filter(|p| sane && p.agreement >= alignment.least_agreement)
}
