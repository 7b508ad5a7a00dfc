//! Agreement of residuals with their sigmas, and the information matrix that follows.

use motorcade_geometry::robust::median;
use nalgebra::SMatrix;

use super::DOF;
use super::problem::{Problem, Row, Term};
use super::solver::Normal;

/// 99 % quantile of χ²₂, derived.
const INLIER_CHI2: f64 = 9.21;
/// Median of χ²₂, derived.
const MEDIAN_CHI2: f64 = 1.386;

/// Agreement of keypoints with a fit.
pub(super) struct Quality {
    pub inliers: Vec<bool>,
    pub residual_sigma: f64,
}

impl Quality {
    pub fn of(rows: &[Row], keypoints: usize) -> Self {
        let mut squares: Vec<(usize, f64)> = Vec::new();
        for row in rows {
            if let Term::Keypoint(index) = row.term {
                match squares.last_mut() {
                    Some((last, s)) if *last == index => *s += row.r * row.r,
                    _ => squares.push((index, row.r * row.r)),
                }
            }
        }
        let mut inliers = vec![false; keypoints];
        for (index, s) in &squares {
            inliers[*index] = *s < INLIER_CHI2;
        }
        let mut values: Vec<f64> = squares.into_iter().map(|(_, s)| s).collect();
        let residual_sigma = (median(&mut values).unwrap_or(0.0) / MEDIAN_CHI2).sqrt();
        Self { inliers, residual_sigma }
    }

    /// Factor on the sigmas of the image terms, at least 1: the residuals of few points are small because the fit follows them.
    pub fn scale(&self) -> f64 {
        self.residual_sigma.max(1.0)
    }
}

/// Information of pose and shape (14×14): image terms at inflated sigmas, and priors. A floor (half a turn, 100 m) regularises
/// undetermined directions.
pub(super) fn information(problem: &Problem<'_>, rows: &[Row], scale: f64) -> SMatrix<f64, DOF, DOF> {
    let image = Normal::of(problem, rows, Term::is_image);
    let known = Normal::of(problem, rows, |t| !t.is_image());
    let mut information = image.h / (scale * scale) + known.h;
    for k in 0..3 {
        information[(k, k)] += 1.0 / (std::f64::consts::PI * std::f64::consts::PI);
        information[(3 + k, 3 + k)] += 1e-4;
    }
    for k in 6 + problem.model.sigmas.len()..DOF {
        information[(k, k)] += 1.0;
    }
    information
}
