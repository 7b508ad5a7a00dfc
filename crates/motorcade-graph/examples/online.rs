//! `online [FRAMES] [LAG]`: feeds a generated multi-body drive (5 poses and 15 edges a frame) to a fixed-lag window frame by
//! frame and prints Markdown rows: CPU time of a frame, and of the covariance of its camera, along the drive.

use cpu_time::ProcessTime;
use motorcade_graph::factors::Between;
use motorcade_graph::generate::{DriveOptions, drive};
use motorcade_graph::{Factor, FixedLag, Options, VariableId};
use nalgebra::Isometry3;

/// Frames around each row's frame; their fastest tenth is printed, which other work on the machine disturbs least.
const AROUND: usize = 50;

fn fast_ms(seconds: &[f64]) -> f64 {
    let mut sorted = seconds.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 10).map_or(f64::NAN, |s| s * 1e3)
}

#[allow(clippy::print_stdout)] // the report is what this program is for
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let frames = args.next().map_or(Ok(5050), |a| a.parse())?;
    let lag = args.next().map_or(Ok(30), |a| a.parse())?;
    let made = drive(&DriveOptions { frames, ..DriveOptions::default() })?.graph;
    let ids: Vec<VariableId> = made.values().iter().map(|(id, _)| id).collect();
    let factors: Vec<&dyn Factor> = made.factors().map(|f| f.1).collect();
    let mut online = FixedLag::new(lag, Options { max_iterations: 4, ..Options::default() })?;
    let (mut next, mut step_s, mut covariance_s) = (0, Vec::new(), Vec::new());
    for frame in ids.chunks(ids.len() / frames) {
        let clock = ProcessTime::now();
        for &id in frame {
            let start = *made.values().get::<Isometry3<f64>>(id)?;
            let added = online.graph_mut().add_variable(start);
            if made.is_fixed(added) {
                online.graph_mut().fix(added)?;
            }
        }
        while let Some(factor) = factors.get(next)
            && factor.variables().iter().all(|v| frame.last().is_some_and(|last| v <= last))
        {
            if let (Some(z), [a, b]) = (factor.relative_pose(), factor.variables()) {
                online.graph_mut().add_factor(Between::new(*a, *b, *z.measurement, *z.information)?)?;
            }
            next += 1;
        }
        online.advance(frame.to_vec())?;
        online.optimise()?;
        step_s.push(clock.elapsed().as_secs_f64());
        let clock = ProcessTime::now();
        online.covariance(frame[0])?;
        covariance_s.push(clock.elapsed().as_secs_f64());
    }
    println!("| frame | ms a frame | covariance of its camera ms |");
    println!("|---|---|---|");
    for row in [100, 1000, 5000] {
        let range = row - AROUND..row + AROUND;
        if let (Some(step), Some(covariance)) = (step_s.get(range.clone()), covariance_s.get(range)) {
            println!("| {row} | {:.2} | {:.2} |", fast_ms(step), fast_ms(covariance));
        }
    }
    Ok(())
}
