//! apex-solver: reads with its own loader, builds the problem as its program `pose_graph_g2o` does.

use std::collections::HashMap;
use std::error::Error;

use apex_solver::apex_io::{G2oLoader, GraphLoader};
use apex_solver::core::loss_functions::HuberLoss;
use apex_solver::core::noise::RepairStrategy;
use apex_solver::core::problem::Problem;
use apex_solver::factors::pose::{BetweenFactor, PriorFactor};
use apex_solver::optimizer::gauss_newton::GaussNewtonConfig;
use apex_solver::optimizer::levenberg_marquardt::LevenbergMarquardtConfig;
use apex_solver::optimizer::{GaussNewton, LevenbergMarquardt};
use apex_solver::{JacobianMode, ManifoldType};
use cpu_time::ProcessTime;
use nalgebra::{DMatrix, dvector};

use crate::Solved;

pub fn solve(file: &str, method: &str, tolerance: f64) -> Result<Solved, Box<dyn Error>> {
    let graph = G2oLoader::load(file)?;
    let mut problem = Problem::new(JacobianMode::Sparse);
    let mut ids: Vec<usize> = graph.vertices_se3.keys().copied().collect();
    ids.sort_unstable();
    let mut keys = HashMap::new();
    for &id in &ids {
        let pose = &graph.vertices_se3[&id].pose;
        let (q, t) = (pose.rotation_quaternion(), pose.translation());
        let start = dvector![t.x, t.y, t.z, q.w, q.i, q.j, q.k];
        keys.insert(id, problem.add_variable(ManifoldType::SE3, start));
    }
    let first = *ids.first().ok_or("no vertices")?;
    if method == "gn" {
        let prior = PriorFactor::new(graph.vertices_se3[&first].pose.clone());
        problem.add_residual_block(&[keys[&first]], Box::new(prior), Some(Box::new(HuberLoss::new(1.0)?)));
    } else {
        for dof in 0..6 {
            problem.fix_variable(keys[&first], dof);
        }
    }
    for edge in &graph.edges_se3 {
        let information = DMatrix::from_column_slice(6, 6, edge.information.as_slice());
        let (noise, _) = RepairStrategy::from_name("clamp")?.build(information)?;
        let between = BetweenFactor::new(edge.measurement.clone());
        let ends = [keys[&edge.from], keys[&edge.to]];
        problem.add_residual_block_with_noise(&ends, Box::new(between), None, noise);
    }
    let clock = ProcessTime::now();
    let result = if method == "gn" {
        let config = GaussNewtonConfig::new()
            .with_max_iterations(100)
            .with_cost_tolerance(tolerance)
            .with_parameter_tolerance(1e-9)
            .with_gradient_tolerance(1e-10);
        GaussNewton::with_config(config).optimize(&mut problem)?
    } else {
        let config = LevenbergMarquardtConfig::new()
            .with_max_iterations(100)
            .with_cost_tolerance(tolerance)
            .with_parameter_tolerance(1e-9)
            .with_gradient_tolerance(1e-10);
        LevenbergMarquardt::with_config(config).optimize(&mut problem)?
    };
    let cpu_s = clock.elapsed().as_secs_f64();
    let vertices = ids
        .iter()
        .map(|id| {
            let x = result.parameters[keys[id]].to_dvector();
            (*id, [x[0], x[1], x[2], x[4], x[5], x[6], x[3]])
        })
        .collect();
    Ok(Solved { cpu_s, vertices })
}
