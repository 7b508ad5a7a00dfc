//! Times the optimisation of a g2o file: `bench FILE [METHOD] [REPEATS]`.
use motorcade_graph::{Options, Solver, g2o};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let path = Path::new(args.get(1).ok_or("no file")?);
    let options =
        Options { method: args.get(2).map_or(Ok(Default::default()), |m| m.parse())?, ..Options::default() };
    let repeats: usize = args.get(3).map_or(Ok(5), |n| n.parse())?;
    let mut best = f64::INFINITY;
    for k in 0..repeats {
        let mut doc = g2o::read(path, &g2o::ReadOptions::default())?;
        doc.graph.anchor_components()?;
        let start = cpu_time::ProcessTime::now();
        let report = Solver::new(options.clone())?.optimise(&mut doc.graph)?;
        let t = start.elapsed().as_secs_f64();
        best = best.min(t);
        if k + 1 == repeats {
            println!(
                "{} {:.1} ms, {} it, {:?} cost {:.10} -> {:.10}",
                path.display(),
                best * 1e3,
                report.iterations.len(),
                report.termination,
                report.initial_cost,
                report.final_cost
            );
            println!(
                "  {:?} factor {} cond {:.1e}",
                report.timings, report.factor_multiplications, report.condition
            );
            for i in &report.iterations {
                println!(
                    "   {} cost {:.8} l {:.2e} gain {:.4} step {:.2e} trials {}",
                    i.iteration, i.cost, i.lambda, i.gain, i.step, i.trials
                );
            }
        }
    }
    Ok(())
}
