//! `graph-peers factrs|apex gn|lm FILE.g2o TOLERANCE REPEATS OUT.g2o`: optimises a graph of SE(3) poses REPEATS times,
//! prints the least CPU seconds of the optimisation alone and writes the optimised vertices.
//!
//! Run with `RAYON_NUM_THREADS=1`. Each peer reads the file and holds its first pose as its own g2o example does.

mod apex;
mod peer_factrs;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};

/// Position and quaternion (x, y, z, w) of a vertex.
pub type Vertex = (usize, [f64; 7]);

/// Result of one run.
pub struct Solved {
    /// CPU seconds of the optimisation.
    pub cpu_s: f64,
    pub vertices: Vec<Vertex>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, peer, method, file, tolerance, repeats, out] = arguments.as_slice() else {
        return Err("give factrs|apex gn|lm FILE TOLERANCE REPEATS OUT".into());
    };
    let (tolerance, repeats): (f64, usize) = (tolerance.parse()?, repeats.parse()?);
    let mut best: Option<Solved> = None;
    for _ in 0..repeats.max(1) {
        let solved = match peer.as_str() {
            "factrs" => peer_factrs::solve(file, method, tolerance)?,
            "apex" => apex::solve(file, method, tolerance)?,
            _ => return Err(format!("unknown peer {peer}").into()),
        };
        if best.as_ref().is_none_or(|b| solved.cpu_s < b.cpu_s) {
            best = Some(solved);
        }
    }
    let best = best.ok_or("no run")?;
    let mut out = BufWriter::new(File::create(out)?);
    for (id, x) in &best.vertices {
        write!(out, "VERTEX_SE3:QUAT {id}")?;
        for v in x {
            write!(out, " {v:.17}")?;
        }
        writeln!(out)?;
    }
    println!("{{\"optimise_s\": {}}}", best.cpu_s);
    Ok(())
}
