//! Correction of a trajectory by its loops.

use motorcade_graph::factors::Between;
use motorcade_graph::solver::GraduateOptions;
use motorcade_graph::{FactorId, Graph, GraphError, LossScale, Marginals, Robust, RobustKernel, VariableId};
use motorcade_odometry::EgoTrajectory;

use super::edge::{MapEdge, PlaceEdges};
use super::options::LoopOptions;
use super::report::LoopReport;
use super::solve::LoopSolve;
use super::{loosen, segments, steps, write};

/// Corrects a trajectory by edges between visits of the same places. Edges are switched off by graduated non-convexity where the others
/// and the odometry contradict them (Yang et al., RA-L 2020), after the odometry's covariance was enlarged as far as that makes steps and edges more probable. Poses and covariances are written back; the road, which is known relative to
/// the camera, moves with it. Without edges nothing changes. Where no edge to a map holds, the world stays that of the drive.
///
/// # Errors
/// A graph that cannot be solved, edges to frames that there are not, a request to stop. The trajectory then stays as it was.
pub fn close_loops(
    ego: &mut EgoTrajectory,
    edges: &PlaceEdges,
    options: &LoopOptions,
    solve: &LoopSolve<'_>,
) -> Result<LoopReport, GraphError> {
    if edges.is_empty() {
        return Ok(LoopReport::default());
    }
    options.validate().map_err(|reason| GraphError::Option { name: "loops", reason })?;
    let mut graph = Graph::new();
    let starts = segments::joined(ego, edges, &options.advanced);
    let cameras: Vec<VariableId> = starts.iter().map(|pose| graph.add_variable(*pose.isometry())).collect();
    if let Some(first) = cameras.first().filter(|_| edges.map.is_empty()) {
        graph.fix(*first)?;
    }
    let (odometry, mut steps) = (graph.add_group(), 0);
    for (nodes, frames) in cameras.windows(2).zip(ego.frames.windows(2)) {
        let step = frames[0].world_from_camera.inverse() * frames[1].world_from_camera;
        let information = steps::information(&frames[1], &step, options, solve.graph, solve.interval_s);
        let id = graph.add_factor(Between::new(nodes[0], nodes[1], *step.isometry(), information)?)?;
        if frames[1].step_measured {
            graph.assign(id, odometry)?;
            steps += 1;
        }
    }
    let group = graph.add_group();
    let kernel = RobustKernel::GemanMcClure(options.advanced.kernel_scale);
    let node = |frame: usize| {
        let size = GraphError::Size { what: "frames of a loop", expected: cameras.len(), found: frame };
        cameras.get(frame).copied().ok_or(size)
    };
    let mut factors: Vec<Between> = Vec::with_capacity(edges.loops.len() + edges.map.len());
    for edge in &edges.loops {
        factors.push(edge.factor(node(edge.later)?, node(edge.earlier)?, options)?);
    }
    for edge in &edges.map {
        factors.push(edge.factor(node(edge.frame)?, &mut graph, options)?);
    }
    let mut ids: Vec<FactorId> = Vec::with_capacity(factors.len());
    for factor in factors {
        let id = graph.add_factor(Robust::new(factor, kernel))?;
        graph.assign(id, group)?;
        ids.push(id);
    }
    graph.set_scale(group, LossScale::convexity(f64::INFINITY))?;
    let most_agree = loosen::until_most_agree(&mut graph, odometry, &ids, &options.advanced, solve)?;
    let schedule = GraduateOptions { c: options.advanced.kernel_scale, ..GraduateOptions::default() };
    solve.graduate(&mut graph, group, &schedule)?;
    let odometry_factor =
        loosen::to_most_probable(&mut graph, (odometry, steps), most_agree, &options.advanced, solve)?;
    let mut weights: Vec<f64> =
        ids.iter().map(|id| graph.loss(*id).map(|l| l.weight)).collect::<Result<_, _>>()?;
    let holds = |weight: &f64| *weight >= options.advanced.least_weight;
    let map: Vec<(f64, bool)> =
        weights.split_off(edges.loops.len()).into_iter().map(|w| (w, holds(&w))).collect();
    let met = edges.map.iter().zip(&map).filter(|(_, (_, holds))| *holds);
    let met: Vec<&MapEdge> = met.map(|(edge, _)| edge).collect();
    if !edges.map.is_empty() && met.is_empty() {
        // The map was the only anchor of that graph.
        let own = PlaceEdges { loops: edges.loops.clone(), map: Vec::new() };
        let report = close_loops(ego, &own, options, solve)?;
        return Ok(LoopReport { map, ..report });
    }
    let closed = weights.iter().map(holds).collect();
    let marginals = Marginals::of_sets(&graph, cameras.iter().map(|id| [*id]), solve.stop)?;
    let most_moved_m = write::back(&graph, &marginals, (&cameras, &met), ego)?;
    Ok(LoopReport { weights, closed, map, odometry_factor, most_moved_m })
}
