//! `large_drive [FRAMES ...]`: generates multi-body drives (5 poses and 15 edges a frame), solves each and prints a
//! Markdown row: how cost and memory grow.

use cpu_time::ProcessTime;
use motorcade_graph::generate::{DriveOptions, drive};
use motorcade_graph::{Options, Solver};

#[allow(clippy::print_stdout)] // the report is what this program is for
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut frames: Vec<usize> = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<_, _>>()?;
    if frames.is_empty() {
        frames = vec![1250, 2500, 5000, 10_000, 20_000];
    }
    println!("| poses | edges | solve s | iterations | ms / iteration | ordering ms | peak memory MB |");
    println!("|---|---|---|---|---|---|---|");
    for frames in frames {
        let mut graph = drive(&DriveOptions { frames, ..DriveOptions::default() })?.graph;
        let clock = ProcessTime::now();
        let report = Solver::new(Options::default())?.optimise(&mut graph)?;
        let (seconds, t) = (clock.elapsed().as_secs_f64(), report.timings);
        let n = report.iterations.len();
        println!(
            "| {} | {} | {seconds:.2} | {n} | {:.1} | {:.1} | {} |",
            graph.values().len(),
            graph.factors().len(),
            (seconds - t.analyse_s) * 1e3 / n as f64,
            t.analyse_s * 1e3,
            peak_memory_mb().map_or("–".to_owned(), |m| m.to_string()),
        );
    }
    Ok(())
}

/// Peak resident memory of this process, where the system reports it.
fn peak_memory_mb() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<usize>().ok()? / 1024)
}
