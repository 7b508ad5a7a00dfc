//! Options of a solve.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::report::Iteration;
use crate::GraphError;

/// Step computed from the normal equations `H δ = −g`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// `H δ = −g`, always taken. Fastest from a good start; may diverge from a bad one.
    #[serde(rename = "gn")]
    GaussNewton,
    /// `(H + λI) δ = −g`; λ = 0 until a step fails, then Nielsen's schedule.
    #[default]
    #[serde(rename = "lm")]
    LevenbergMarquardt,
    /// Powell's dog-leg: one factorisation for each linearisation, however many steps are refused.
    DogLeg,
}

impl std::str::FromStr for Method {
    type Err = GraphError;
    fn from_str(s: &str) -> Result<Self, GraphError> {
        match s {
            "gn" => Ok(Self::GaussNewton),
            "lm" => Ok(Self::LevenbergMarquardt),
            "dogleg" => Ok(Self::DogLeg),
            _ => {
                Err(GraphError::Option { name: "method", reason: format!("{s:?} is none of lm, gn, dogleg") })
            }
        }
    }
}

/// Options of [`optimise`](super::optimise). The defaults suit pose graphs.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Options {
    /// Step.
    pub method: Method,
    /// Most linearisations; the paper's 100.
    pub max_iterations: usize,
    /// Stop when a step lowers (or promises to lower) the cost by less than this fraction.
    pub relative_decrease: f64,
    /// Stop when no component of a step is larger \[rad, m\].
    pub step_size: f64,
    /// First damping after a failed Gauss–Newton step, as a fraction of the largest diagonal entry of H.
    pub initial_lambda: f64,
    /// Wall-clock limit \[s\]; the best solution so far is kept. It is looked at between iterations and within long factorisations.
    pub time_limit_s: Option<f64>,
    /// Threads; 0 for all cores. The result is the same, bit for bit, for any number.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::LevenbergMarquardt,
            max_iterations: 100,
            relative_decrease: 1e-6,
            step_size: 1e-6,
            initial_lambda: 1e-7,
            time_limit_s: None,
            threads: 1,
        }
    }
}

impl Options {
    /// Refuses values outside their range.
    pub fn validate(&self) -> Result<(), GraphError> {
        for (name, x) in [
            ("relative_decrease", self.relative_decrease),
            ("step_size", self.step_size),
            ("initial_lambda", self.initial_lambda),
            ("time_limit_s", self.time_limit_s.unwrap_or(0.0)),
        ] {
            if !(x.is_finite() && x >= 0.0) {
                return Err(GraphError::Option { name, reason: format!("{x} is not a number from 0 up") });
            }
        }
        if self.initial_lambda == 0.0 {
            return Err(GraphError::Option { name: "initial_lambda", reason: "must be positive".into() });
        }
        Ok(())
    }

    /// The same with what is left of the time limit for work begun at `start`.
    #[must_use]
    pub fn remaining(&self, start: Instant) -> Self {
        let left = self.time_limit_s.map(|limit| (limit - start.elapsed().as_secs_f64()).max(0.0));
        Self { time_limit_s: left, ..self.clone() }
    }

    /// True when nothing is left of it.
    pub(crate) fn out_of_time(&self, start: Instant) -> bool {
        self.remaining(start).time_limit_s == Some(0.0)
    }
}

/// Called with every finished iteration.
pub type Progress = Arc<dyn Fn(&Iteration) + Send + Sync>;

/// A hold on a running solver: cancellation and progress.
#[derive(Clone, Default)]
pub struct Control {
    /// Set to stop after the current iteration, or within a long factorisation; the best solution so far is kept.
    pub cancel: Option<Arc<AtomicBool>>,
    /// Called after every iteration.
    pub progress: Option<Progress>,
}

impl Control {
    pub(crate) fn cancelled(&self) -> bool {
        self.cancel.as_ref().is_some_and(|c| c.load(Ordering::Relaxed))
    }
}

impl fmt::Debug for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Control").field("cancel", &self.cancel).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn what_is_left_of_a_time_limit_shrinks_to_nothing() {
        let Some(start) = Instant::now().checked_sub(Duration::from_secs(2)) else { return };
        let limited = |s| Options { time_limit_s: Some(s), ..Options::default() };
        let left = limited(60.0).remaining(start).time_limit_s.unwrap_or(0.0);
        assert!((50.0..=58.0).contains(&left), "{left}");
        assert!(limited(1.0).out_of_time(start) && !limited(60.0).out_of_time(start));
        assert!(!Options::default().out_of_time(start));
    }
}
