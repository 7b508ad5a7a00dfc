//! Fixed-lag smoothing: a window of recent variables, optimised from the last solution, the past kept as a prior.

mod state;

use std::collections::VecDeque;

use motorcade_sparse::Stop;
use nalgebra::DMatrix;

use crate::GraphError;
use crate::graph::Graph;
use crate::ids::FactorId;
use crate::ids::VariableId;
use crate::marginalise::marginalise;
use crate::marginals::Marginals;
use crate::solver::{Options, Report, Solver};

pub use state::FixedLagState;

/// A graph over the last `lag` frames. Cost and memory of a frame stay the same from start to end of a drive.
///
/// For every frame: add its variables and factors through [`graph_mut`](Self::graph_mut), name the variables that
/// belong to it in [`advance`](Self::advance), then [`optimise`](Self::optimise).
///
/// Factors may also be replaced while their frame is in the window, where measurements become better known:
/// [`remove_measurements`](Self::remove_measurements) leaves only the priors of what was marginalised. A window without a
/// limit ([`unbounded`](Self::unbounded)) is a batch problem; its frames leave by [`retire_oldest`](Self::retire_oldest)
/// alone.
#[derive(Debug)]
pub struct FixedLag {
    graph: Graph,
    solver: Solver,
    lag: usize,
    frames: VecDeque<Vec<VariableId>>,
    /// Priors of variables that were marginalised, increasing.
    priors: Vec<FactorId>,
    /// True from a solve to the next change of the graph.
    solved: bool,
}

impl FixedLag {
    /// A window of `lag` frames (at least 1). A few iterations a frame suffice from a warm start.
    pub fn new(lag: usize, options: Options) -> Result<Self, GraphError> {
        if lag == 0 {
            return Err(GraphError::Option { name: "lag", reason: "must be at least 1".into() });
        }
        Ok(Self {
            graph: Graph::new(),
            solver: Solver::new(options)?,
            lag,
            frames: VecDeque::new(),
            priors: Vec::new(),
            solved: false,
        })
    }

    /// A window that frames leave only by [`retire_oldest`](Self::retire_oldest).
    pub fn unbounded(options: Options) -> Result<Self, GraphError> {
        Self::new(usize::MAX, options)
    }

    /// The graph of the window.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// The graph of the window, to add to.
    pub fn graph_mut(&mut self) -> &mut Graph {
        self.solved = false;
        &mut self.graph
    }

    /// Opens a frame with the variables added for it and marginalises the frame that falls out of the window.
    /// Variables never named in a frame stay (a scale, a calibration). Returns the variables that left.
    pub fn advance(&mut self, variables: Vec<VariableId>) -> Result<Vec<VariableId>, GraphError> {
        self.solved = false;
        self.frames.push_back(variables);
        if self.frames.len() <= self.lag { Ok(Vec::new()) } else { self.retire_oldest() }
    }

    /// Puts a variable into frame `index` of the window, the oldest being 0; it leaves with it.
    pub fn assign(&mut self, index: usize, variable: VariableId) {
        if let Some(frame) = self.frames.get_mut(index) {
            frame.push(variable);
        }
    }

    /// Frames in the window.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// True before the first frame.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Marginalises the oldest frame; returns its variables.
    pub fn retire_oldest(&mut self) -> Result<Vec<VariableId>, GraphError> {
        let old = self.frames.pop_front().unwrap_or_default();
        let leaving: Vec<VariableId> =
            old.into_iter().filter(|&id| self.graph.values().value(id).is_ok()).collect();
        self.retire(&leaving)?;
        Ok(leaving)
    }

    /// Removes all factors but the priors of what was marginalised.
    pub fn remove_measurements(&mut self) {
        self.solved = false;
        let measured = |id: &FactorId| self.priors.binary_search(id).is_err();
        let gone: Vec<FactorId> = self.graph.factors().map(|(id, _)| id).filter(measured).collect();
        self.graph.remove_factors(&gone);
    }

    /// Marginalises variables ahead of their time, for example all of a track that has ended: they are leaves and
    /// only join the cameras that saw them.
    pub fn retire(&mut self, variables: &[VariableId]) -> Result<(), GraphError> {
        if variables.is_empty() {
            return Ok(());
        }
        self.solved = false;
        let prior = marginalise(&mut self.graph, variables)?;
        self.priors.retain(|id| self.graph.factor(*id).is_some());
        self.priors.extend(prior);
        Ok(())
    }

    /// Gives back the memory of the last solve, more than that of all covariances: worth it for a whole drive, whose window is solved once or twice.
    pub fn forget_solve(&mut self) {
        self.solver.forget();
    }

    /// Covariances of the window, linearised at the current values.
    pub fn marginals(&self) -> Result<Marginals, GraphError> {
        Marginals::new(&self.graph)
    }

    /// Optimises the window from its current values.
    pub fn optimise(&mut self) -> Result<Report, GraphError> {
        self.optimise_unless(Stop::NEVER)
    }

    /// As [`optimise`](Self::optimise); a solve that is asked to stop is cancelled.
    ///
    /// # Errors
    /// As [`optimise`](Self::optimise).
    pub fn optimise_unless(&mut self, stop: Stop<'_>) -> Result<Report, GraphError> {
        let report = self.solver.optimise_unless(&mut self.graph, stop)?;
        self.solved = true;
        Ok(report)
    }

    /// Covariance (dof × dof) of one variable of the window, the newest pose for example, given all that was ever
    /// measured up to now.
    ///
    /// Right after [`optimise`](Self::optimise) it is computed from that solve's last factor, hence from the linearisation
    /// before its last steps, at the cost of a few small dense products. Otherwise the window is linearised and factorised
    /// again.
    pub fn covariance(&self, variable: VariableId) -> Result<DMatrix<f64>, GraphError> {
        match self.solver.covariance(variable).filter(|_| self.solved) {
            Some(covariance) => Ok(covariance),
            None => Marginals::new(&self.graph)?.covariance(variable),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{DVector, Isometry3};

    use super::*;
    use crate::factors::{Between, LinearPrior};
    use crate::generate::{DriveOptions, drive};
    use crate::manifold::Value;

    /// Work of one frame.
    #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
    struct Work {
        slots: usize,
        variables: usize,
        factors: usize,
        unknowns: usize,
        factor_scalars: usize,
        multiplications: f64,
        iterations: usize,
    }

    /// Runs a drive through a window that also holds a scale from the first frame to the last. New poses start where
    /// their first measurement puts them.
    fn work(options: &DriveOptions, lag: usize) -> (FixedLag, Vec<Work>) {
        let made = drive(options).unwrap().graph;
        let mut online = FixedLag::new(lag, Options { max_iterations: 4, ..Options::default() }).unwrap();
        let scale = online.graph_mut().add_variable(1.0);
        let known = DMatrix::identity(1, 1);
        let prior = LinearPrior::new(vec![scale], vec![Value::from(1.1)], DVector::zeros(1), known).unwrap();
        online.graph_mut().add_factor(prior).unwrap();
        let moved = |id: VariableId| VariableId(id.0 + 1);
        let mut factors = made.factors().map(|f| f.1).peekable();
        let ids: Vec<VariableId> = made.values().iter().map(|(id, _)| id).collect();
        let mut rows = Vec::new();
        for frame in ids.chunks(options.vehicles + 1) {
            let graph = online.graph_mut();
            let newest = frame[frame.len() - 1];
            if frame[0].index() == 0 {
                let first = graph.add_variable(*made.values().get::<Isometry3<f64>>(frame[0]).unwrap());
                graph.fix(first).unwrap();
            }
            while let Some(factor) = factors.next_if(|f| f.variables().iter().all(|v| *v <= newest)) {
                let z = factor.relative_pose().unwrap();
                let [a, b] = [0, 1].map(|k| moved(factor.variables()[k]));
                if graph.values().value(b).is_err() {
                    let start = graph.values().get::<Isometry3<f64>>(a).unwrap() * z.measurement;
                    assert_eq!(graph.add_variable(start), b);
                }
                graph.add_factor(Between::new(a, b, *z.measurement, *z.information).unwrap()).unwrap();
            }
            online.advance(frame.iter().copied().map(moved).collect()).unwrap();
            let report = online.optimise().unwrap();
            rows.push(Work {
                slots: online.graph.values().slots(),
                variables: online.graph.values().len(),
                factors: online.graph.factors().len(),
                unknowns: report.unknowns,
                factor_scalars: report.factor_scalars,
                multiplications: report.factor_multiplications,
                iterations: report.iterations.len(),
            });
        }
        (online, rows)
    }

    fn most(rows: &[Work]) -> Work {
        rows.iter().fold(Work::default(), |m, r| Work {
            slots: m.slots.max(r.slots),
            variables: m.variables.max(r.variables),
            factors: m.factors.max(r.factors),
            unknowns: m.unknowns.max(r.unknowns),
            factor_scalars: m.factor_scalars.max(r.factor_scalars),
            multiplications: m.multiplications.max(r.multiplications),
            iterations: m.iterations.max(r.iterations),
        })
    }

    #[test]
    fn work_of_a_frame_does_not_grow_with_the_drive() {
        let options = DriveOptions { frames: 1600, vehicles: 2, track_length: 12, lap: 0, seed: 5 };
        let (online, rows) = work(&options, 15);
        let (early, late) = (most(&rows[50..250]), most(&rows[1400..]));
        // A window of 45 poses and the scale; few slots more.
        assert_eq!((early.variables, late.variables), (46, 46));
        assert!(early.slots.max(late.slots) <= 46 + 46 + 2 * SPARE, "{early:?} {late:?}");
        let same = |w: Work| Work { slots: 0, ..w };
        assert_eq!(same(early), same(late));
        let iterations = |rows: &[Work]| rows.iter().map(|r| r.iterations).sum::<usize>();
        assert!(iterations(&rows[1400..]) <= iterations(&rows[50..250]) * 11 / 10);
        assert!((*online.graph.values().get::<DVector<f64>>(VariableId(0)).unwrap())[0] > 1.09);
    }

    /// Slots that may be empty.
    const SPARE: usize = 64;

    #[test]
    fn a_shifted_window_of_the_same_pattern_is_not_analysed_again() {
        let options = DriveOptions { frames: 300, vehicles: 0, track_length: 1, lap: 0, seed: 6 };
        let (online, rows) = work(&options, 20);
        assert_eq!(rows.len(), 300);
        assert!(online.solver.analyses() < 40, "{}", online.solver.analyses());
    }

    #[test]
    fn covariance_out_of_the_last_factor_is_the_full_one() {
        let options = DriveOptions { frames: 60, vehicles: 2, track_length: 12, lap: 0, seed: 7 };
        let (mut online, _) = work(&options, 15);
        let ids: Vec<VariableId> = online.graph.values().iter().map(|(id, _)| id).collect();
        online.solver = Solver::new(Options { relative_decrease: 1e-13, ..Options::default() }).unwrap();
        online.optimise().unwrap();
        for id in ids {
            let full = Marginals::new(&online.graph).unwrap().covariance(id).unwrap();
            let off = (online.covariance(id).unwrap() - &full).amax() / full.amax();
            assert!(off < 1e-3, "{id}: {off}");
            online.graph_mut();
            assert_eq!(online.covariance(id).unwrap(), full);
            online.solved = true;
        }
    }
}
