//! factrs: reads with its own `load_g20`, optimises as in its example `g2o.rs`.

use std::error::Error;

use cpu_time::ProcessTime;
use factrs::assign_symbols;
use factrs::containers::Values;
use factrs::core::{GaussNewton, LevenMarquardt, SE3};
use factrs::optimizers::{BaseOptParams, LevenParams};
use factrs::traits::Optimizer;
use factrs::utils::load_g20;

use crate::{Solved, Vertex};

assign_symbols!(X: SE3);

pub fn solve(file: &str, method: &str, tolerance: f64) -> Result<Solved, Box<dyn Error>> {
    let (graph, start) = load_g20(file);
    let base = BaseOptParams {
        max_iterations: 100,
        error_tol_relative: tolerance,
        error_tol_absolute: 0.0,
        error_tol: 0.0,
    };
    let clock;
    let result = if method == "gn" {
        let mut gn: GaussNewton = GaussNewton::new(base, graph);
        clock = ProcessTime::now();
        gn.optimize(start)
    } else {
        let mut lm: LevenMarquardt = LevenMarquardt::new(LevenParams { base, ..LevenParams::default() }, graph);
        clock = ProcessTime::now();
        lm.optimize(start)
    };
    let cpu_s = clock.elapsed().as_secs_f64();
    let values = result.map_err(|e| format!("factrs: {e:?}"))?;
    Ok(Solved { cpu_s, vertices: vertices(file, &values)? })
}

fn vertices(file: &str, values: &Values) -> Result<Vec<Vertex>, Box<dyn Error>> {
    let mut out = Vec::new();
    for line in std::fs::read_to_string(file)?.lines().filter(|l| l.starts_with("VERTEX")) {
        let id: u32 = line.split_whitespace().nth(1).ok_or("vertex without id")?.parse()?;
        let pose: &SE3 = values.get(X(id)).ok_or("vertex lost")?;
        let (r, t) = (pose.rot(), pose.xyz());
        out.push((id as usize, [t[0], t[1], t[2], r.x(), r.y(), r.z(), r.w()]));
    }
    Ok(out)
}
