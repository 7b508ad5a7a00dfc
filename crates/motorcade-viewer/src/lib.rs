//! The report of a run: one self-contained HTML file.
//!
//! [`Report`] draws trajectories in a top view, to scale; speeds, metric scale and road over time; tables of vehicles, timings,
//! warnings and settings. The same run gives the same bytes. Drawings are SVG inside the page; a script moves through the
//! frames, zooms the map and follows one vehicle, and the drawings are readable without it. With [`Pictures`] of the frames the
//! page shows them with the vehicles in them.
//!
//! ```no_run
//! # fn page(result: &motorcade::RunResult, context: &motorcade::RunContext) -> std::io::Result<()> {
//! let report = motorcade_viewer::Report { result, context, evaluation: None, pictures: &[] };
//! std::fs::write("report.html", report.html())
//! # }
//! ```

mod ahead;
mod axis;
mod chart;
mod details;
mod elevation;
mod evaluation;
mod headline;
mod hue;
mod map;
mod outline;
mod page;
mod placement;
mod player;
mod road;
mod speed;
mod strip;
mod text;
mod vehicles;

pub use hue::{hue, rgb};
pub use outline::{MOVING, is_doubtful, is_unsure};
pub use page::Report;
pub use player::{Picture, Pictures};
