//! The report of a run: one self-contained HTML file.
//!
//! [`report`] draws trajectories in a top view, to scale; speeds, metric scale and road over time; tables of vehicles, timings,
//! warnings and settings. The same run gives the same bytes. Drawings are SVG inside the page; a small script adds a crosshair
//! and highlights one vehicle, and everything is readable without it.
//!
//! ```no_run
//! # fn page(result: &motorcade::RunResult, context: &motorcade::RunContext) -> std::io::Result<()> {
//! std::fs::write("report.html", motorcade_viewer::report(result, context, None))
//! # }
//! ```

mod ahead;
mod axis;
mod chart;
mod details;
mod evaluation;
mod headline;
mod hue;
mod map;
mod outline;
mod page;
mod placement;
mod road;
mod speed;
mod strip;
mod text;
mod vehicles;

pub use hue::hue;
pub use outline::MOVING;
pub use page::report;
