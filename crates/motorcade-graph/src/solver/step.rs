//! One linearised problem and the steps that can be taken from it.

use std::time::Instant;

use motorcade_sparse::{Cholesky, Stop, Unfactorised};

use super::limits::Limits;
use super::problem::Problem;
use super::report::Timings;

/// Solves with the current matrix; counts its time.
#[derive(Debug, Default)]
pub(crate) struct Linear {
    pub factor: Cholesky,
    pub delta: Vec<f64>,
    /// True while `factor` is one of `H` itself.
    pub undamped: bool,
}

impl Linear {
    /// `(H + λI) δ = −g` into `delta`.
    ///
    /// # Errors
    /// A matrix that is not positive definite; a limit that was reached.
    pub(crate) fn step(
        &mut self,
        problem: &Problem,
        lambda: f64,
        parallel: bool,
        timings: &mut Timings,
        limits: &Limits<'_>,
    ) -> Result<(), Unfactorised> {
        let start = Instant::now();
        self.delta.clear();
        self.delta.extend_from_slice(&problem.matrix.rhs);
        let reached = || limits.reached().is_some();
        let (matrix, stop) = (&problem.matrix, Stop::new(&reached));
        let done = self.factor.factorise(matrix, lambda, parallel, Some(&mut self.delta), stop);
        timings.factorise_s += start.elapsed().as_secs_f64();
        self.undamped = done.is_ok() && lambda == 0.0;
        done?;
        if self.backward(problem, timings) { Ok(()) } else { Err(Unfactorised::NotPositiveDefinite) }
    }

    /// The same with the factor of an earlier step; returns the decrease it promises, none where that is more than
    /// `limit`, which shows before all is solved.
    pub(crate) fn again(&mut self, problem: &Problem, limit: f64, timings: &mut Timings) -> Option<f64> {
        let start = Instant::now();
        self.delta.clear();
        self.delta.extend_from_slice(&problem.matrix.rhs);
        let promised = self.factor.solve_forward_within(&problem.matrix, &mut self.delta, limit);
        timings.solve_s += start.elapsed().as_secs_f64();
        promised.filter(|_| self.backward(problem, timings))
    }

    fn backward(&mut self, problem: &Problem, timings: &mut Timings) -> bool {
        let start = Instant::now();
        self.factor.solve_backward(&problem.matrix, &mut self.delta);
        timings.solve_s += start.elapsed().as_secs_f64();
        self.delta.iter().all(|x| x.is_finite())
    }
}

/// Decrease of the cost promised by a damped step: `−gᵀδ + λ δᵀδ`.
pub(crate) fn damped_decrease(rhs: &[f64], delta: &[f64], lambda: f64) -> f64 {
    let (mut down, mut square) = (0.0, 0.0);
    for (b, d) in rhs.iter().zip(delta) {
        down += b * d;
        square += d * d;
    }
    down + lambda * square
}

pub(crate) fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| v.abs().max(m))
}

pub(crate) fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| a * b).sum()
}

/// The dog-leg inside `radius`: along steepest descent to its minimum, then towards the Gauss–Newton point.
pub(crate) fn dog_leg(cauchy: &[f64], newton: &[f64], radius: f64, out: &mut Vec<f64>) {
    out.clear();
    if dot(newton, newton).sqrt() <= radius {
        out.extend_from_slice(newton);
        return;
    }
    let short = dot(cauchy, cauchy).sqrt();
    if short >= radius {
        out.extend(cauchy.iter().map(|x| x * radius / short));
        return;
    }
    // |c + t (n − c)| = radius
    let (mut a, mut b) = (0.0, 0.0);
    for (c, n) in cauchy.iter().zip(newton) {
        a += (n - c) * (n - c);
        b += c * (n - c);
    }
    let t = (-b + (b * b + a * (radius * radius - short * short)).sqrt()) / a;
    out.extend(cauchy.iter().zip(newton).map(|(c, n)| c + t * (n - c)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dog_leg_has_three_parts() {
        let (cauchy, newton, mut out) = ([1.0, 0.0], [2.0, 2.0], Vec::new());
        dog_leg(&cauchy, &newton, 5.0, &mut out);
        assert_eq!(out, newton);
        dog_leg(&cauchy, &newton, 0.5, &mut out);
        assert_eq!(out, [0.5, 0.0]);
        dog_leg(&cauchy, &newton, 2.0, &mut out);
        assert!((dot(&out, &out) - 4.0).abs() < 1e-12 && out[1] > 0.0);
    }
}
