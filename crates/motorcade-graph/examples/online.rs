//! `online [FRAMES] [LAG]`: feeds a generated multi-body drive (5 poses and 15 edges a frame) to a fixed-lag window frame by
//! frame and prints Markdown rows: what a frame costs along the drive, counted and in CPU time, how much of it is the
//! analysis of the pattern, and the covariance of its camera. New poses start where their first measurement puts them.

use cpu_time::ProcessTime;
use motorcade_geometry::robust;
use motorcade_graph::factors::Between;
use motorcade_graph::generate::{DriveOptions, drive};
use motorcade_graph::{FixedLag, Options, VariableId};
use nalgebra::Isometry3;

/// Frames around each row's frame whose median is printed.
const AROUND: usize = 100;

/// One frame.
struct Row {
    step_ms: f64,
    analysis_ms: f64,
    covariance_ms: f64,
    unknowns: f64,
    factors: f64,
    iterations: f64,
    megaflop: f64,
}

fn median(rows: &[Row], what: fn(&Row) -> f64) -> f64 {
    let mut values: Vec<f64> = rows.iter().map(what).collect();
    robust::median(&mut values).unwrap_or(f64::NAN)
}

#[allow(clippy::print_stdout)] // the report is what this program is for
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let frames = args.next().map_or(Ok(5100), |a| a.parse())?;
    let lag = args.next().map_or(Ok(30), |a| a.parse())?;
    let made = drive(&DriveOptions { frames, ..DriveOptions::default() })?.graph;
    let ids: Vec<VariableId> = made.values().iter().map(|(id, _)| id).collect();
    let mut factors = made.factors().map(|f| f.1).peekable();
    let mut online = FixedLag::new(lag, Options { max_iterations: 4, ..Options::default() })?;
    let mut rows = Vec::new();
    for frame in ids.chunks(ids.len() / frames) {
        let clock = ProcessTime::now();
        let graph = online.graph_mut();
        if graph.values().is_empty() {
            let first = graph.add_variable(*made.values().get::<Isometry3<f64>>(frame[0])?);
            graph.fix(first)?;
        }
        let newest = frame[frame.len() - 1];
        while let Some(factor) = factors.next_if(|f| f.variables().iter().all(|v| *v <= newest)) {
            let (Some(z), &[a, b]) = (factor.relative_pose(), factor.variables()) else { continue };
            if graph.values().value(b).is_err() {
                let start = graph.values().get::<Isometry3<f64>>(a)? * z.measurement;
                graph.add_variable(start);
            }
            graph.add_factor(Between::new(a, b, *z.measurement, *z.information)?)?;
        }
        online.advance(frame.to_vec())?;
        let report = online.optimise()?;
        let step_ms = clock.elapsed().as_secs_f64() * 1e3;
        let clock = ProcessTime::now();
        online.covariance(frame[0])?;
        rows.push(Row {
            step_ms,
            analysis_ms: report.timings.analyse_s * 1e3,
            covariance_ms: clock.elapsed().as_secs_f64() * 1e3,
            unknowns: report.unknowns as f64,
            factors: online.graph().factors().len() as f64,
            iterations: report.iterations.len() as f64,
            megaflop: report.factor_multiplications * 2e-6,
        });
    }
    println!(
        "| frame | unknowns | factors | iterations | MFLOP a factorisation | ms a frame | analysis ms | covariance ms |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for row in [100, 1000, 5000] {
        let Some(part) = rows.get(row - AROUND..row + AROUND) else { continue };
        let of = |what| median(part, what);
        println!(
            "| {row} | {} | {} | {} | {:.2} | {:.2} | {:.2} | {:.3} |",
            of(|r| r.unknowns),
            of(|r| r.factors),
            of(|r| r.iterations),
            of(|r| r.megaflop),
            of(|r| r.step_ms),
            of(|r| r.analysis_ms),
            of(|r| r.covariance_ms)
        );
    }
    Ok(())
}
