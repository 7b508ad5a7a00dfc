//! Levenberg–Marquardt steps with Nielsen's damping, and steps with an earlier factor.

use motorcade_sparse::Unfactorised;

use super::report::{Iteration, Termination};
use super::run::{MAX_TRIALS, Outcome, ROUNDING, Run};
use super::step::{damped_decrease, largest};
use crate::GraphError;

/// Gain of a step after which the linearisation counts as good enough to keep its factor.
const AS_PROMISED: std::ops::RangeInclusive<f64> = 0.75..=1.33;

impl Run<'_> {
    /// A Gauss–Newton step with the last factor in place of a new one (the chord, or Shamanskii, method): near the
    /// minimum H hardly changes, so several such steps cost less than a factorisation. `None` where one is better.
    pub(super) fn chord(&mut self) -> Result<Option<Outcome>, GraphError> {
        let Some(last) = self.settled.take() else { return Ok(None) };
        let before = self.cost;
        let small = self.options.relative_decrease * before;
        // Each step shrinks the promise by the same factor c: 1 + ln(small / predicted) / ln c steps with c = predicted / last
        // are to cost no more than the factorisation.
        let most = 2.0 + self.problem.factorisation_in_steps();
        let limit = last * (small / last).min(1.0).powf(1.0 / most);
        let Some(predicted) = self.linear.again(self.problem, limit, &mut self.timings) else {
            return Ok(None);
        };
        // Cheap steps, but refused more often: no linearisation on trust.
        let trusting = std::mem::take(&mut self.trusting);
        let trial = self.try_step(predicted)?;
        self.trusting = trusting;
        let gain = (before - trial) / predicted;
        let rounding = predicted <= small && trial <= before * (1.0 + ROUNDING);
        if !rounding && !AS_PROMISED.contains(&gain) {
            return Ok(None);
        }
        self.accept(trial, gain);
        self.settled = Some(predicted);
        let row = Iteration { factorised: false, ..self.row(predicted, before, trial, 1) };
        Ok(Some(Outcome { stop: self.stop(before, predicted, row.step), row }))
    }

    /// The step of `(H + λI) δ = −g`, λ raised until the cost falls.
    pub(super) fn levenberg_marquardt(&mut self) -> Result<Outcome, GraphError> {
        let before = self.cost;
        let highest = self.problem.matrix.diagonal().fold(f64::MIN_POSITIVE, f64::max);
        let floor = self.options.initial_lambda * highest;
        let mut predicted = 0.0;
        for trials in 1..=MAX_TRIALS {
            let (problem, limits) = (&*self.problem, &self.limits);
            let solved = self.linear.step(problem, self.lambda, self.parallel, &mut self.timings, limits);
            if solved == Err(Unfactorised::Stopped) {
                return Err(GraphError::Stopped);
            }
            if solved.is_ok() {
                predicted = damped_decrease(&self.problem.matrix.rhs, &self.linear.delta, self.lambda);
                let trial = self.try_step(predicted)?;
                let gain = (before - trial) / predicted;
                let negligible = predicted <= self.options.relative_decrease * before;
                if gain > 1e-4 || (negligible && trial <= before * (1.0 + ROUNDING)) {
                    self.accept(trial, gain);
                    self.settled = (self.lambda == 0.0 && AS_PROMISED.contains(&gain)).then_some(predicted);
                    let row = self.row(predicted, before, trial, trials);
                    return Ok(Outcome { stop: self.relax(before, predicted, gain, row.step, floor), row });
                }
                if negligible || largest(&self.linear.delta) <= self.options.step_size {
                    let row = self.row(predicted, before, trial, trials);
                    return Ok(Outcome { row, stop: Some(Termination::Converged) });
                }
                self.refuse()?;
            }
            // A failed Gauss–Newton step falls back to the damping that worked last.
            let least = if self.lambda == 0.0 { self.worked.max(1e-3 * floor) } else { floor * 1e-3 };
            self.lambda = (self.lambda * self.growth).max(least);
            self.growth *= 2.0;
            if !self.lambda.is_finite() || self.lambda > 1e12 * highest {
                break;
            }
        }
        let row = self.row(predicted, before, before, MAX_TRIALS);
        Ok(Outcome { row, stop: Some(Termination::Stalled) })
    }

    /// Lowers the damping after a good step and decides whether to stop. A small decrease under damping is no evidence of a minimum:
    /// the damping may be what keeps the step short, so it takes several of them, with ever less damping.
    fn relax(
        &mut self,
        before: f64,
        predicted: f64,
        gain: f64,
        step: f64,
        floor: f64,
    ) -> Option<Termination> {
        let stop = self.stop(before, predicted, step);
        let damped = self.lambda > 0.0;
        self.growth = 2.0;
        if damped {
            self.worked = self.lambda;
            // Nielsen: shrink by how well the model held; much faster than his third where it held throughout.
            let shrink =
                if gain > 0.9 { 0.1 } else { (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0) };
            self.lambda *= if stop.is_some() { 0.01 } else { shrink };
            if self.lambda < 1e-4 * floor {
                self.lambda = 0.0;
            }
        } else {
            self.worked = 0.0;
        }
        self.quiet = if stop.is_some() { self.quiet + 1 } else { 0 };
        stop.filter(|_| !damped || self.quiet >= 4)
    }
}
