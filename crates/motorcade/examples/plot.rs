//! Plots a finished run from above: `cargo run --release --example plot -- runs/demo plot.svg`.

#![allow(clippy::print_stdout, reason = "an example talks")]

use std::fmt::Write as _;
use std::path::Path;

use motorcade::dataset::read_trajectory;
use motorcade::geometry::{Camera, Frame, Vehicle, World};

/// Points from above: x to the right, z upwards \[m\].
type Line = Vec<[f64; 2]>;

fn line<From: Frame>(path: &Path) -> Result<Line, Box<dyn std::error::Error>> {
    let trajectory = read_trajectory::<World, From>(path)?;
    Ok(trajectory.poses.iter().map(|p| p.translation()).map(|t| [t.x, -t.z]).collect())
}

fn polyline(svg: &mut String, points: &Line, colour: &str) -> std::fmt::Result {
    let text: Vec<String> = points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
    writeln!(
        svg,
        r#"<polyline fill="none" stroke="{colour}" stroke-width="0.5" points="{}"/>"#,
        text.join(" ")
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [run, out] = arguments.as_slice() else { return Err("expected RUN OUT.svg".into()) };
    let run = Path::new(run);
    let camera = line::<Camera>(&run.join("ego.tum"))?;
    let mut vehicles = Vec::new();
    if let Ok(entries) = std::fs::read_dir(run.join("vehicles")) {
        let mut paths: Vec<_> = entries.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
        paths.sort();
        for path in paths {
            vehicles.push(line::<Vehicle>(&path)?);
        }
    }

    let all = || vehicles.iter().chain([&camera]).flatten();
    let reach = |axis: usize, start: f64, f: fn(f64, f64) -> f64| all().map(|p| p[axis]).fold(start, f);
    let low = [0, 1].map(|axis| reach(axis, f64::INFINITY, f64::min) - 5.0);
    let high = [0, 1].map(|axis| reach(axis, f64::NEG_INFINITY, f64::max) + 5.0);
    let (width, height) = (high[0] - low[0], high[1] - low[1]);
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="{:.1} {:.1} {width:.1} {height:.1}">"#,
        low[0], low[1]
    );
    for vehicle in &vehicles {
        polyline(&mut svg, vehicle, "#d9822b")?;
    }
    polyline(&mut svg, &camera, "#1f6feb")?;
    svg.push_str("</svg>\n");
    std::fs::write(out, svg)?;
    println!("{} poses, {} vehicles: {out}", camera.len(), vehicles.len());
    Ok(())
}
