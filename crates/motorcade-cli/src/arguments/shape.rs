//! Arguments of `motorcade shape`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use motorcade_shape::Layout;

/// Shape priors of vehicles, for `motorcade run --shape-prior`.
#[derive(Debug, Subcommand)]
#[command(
    after_help = "Examples:\n  motorcade shape export --out prior.json\n  motorcade shape info prior.json"
)]
pub enum ShapeCommand {
    /// The project's own prior as JSON, to start one's own from.
    Export {
        /// car-36 or car-14.
        #[arg(long, value_parser = parse_layout, default_value = "car-36")]
        layout: Layout,
        /// The file.
        #[arg(long)]
        out: PathBuf,
    },
    /// Published tables of mean and basis to JSON.
    Convert(ShapeConvertArguments),
    /// Describes a prior.
    Info {
        /// The file.
        prior: PathBuf,
    },
}

/// `motorcade shape convert`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  motorcade shape convert mean_36.txt basis_36.txt --layout car-36 --out prior.json"
)]
pub struct ShapeConvertArguments {
    /// Mean: a row of three coordinates a keypoint.
    pub mean: PathBuf,
    /// Basis: a row a deformation.
    pub basis: PathBuf,
    /// car-36 (x forward, y up, z right) or car-14 (x left, y backward, z up).
    #[arg(long, value_parser = parse_layout)]
    pub layout: Layout,
    /// Bumper to bumper length the mean is scaled to [m].
    #[arg(long, default_value_t = 4.1)]
    pub length: f64,
    /// The file.
    #[arg(long)]
    pub out: PathBuf,
}

fn parse_layout(text: &str) -> Result<Layout, String> {
    match text {
        "car-36" => Ok(Layout::Car36),
        "car-14" => Ok(Layout::Car14),
        _ => Err("one of car-36, car-14".to_owned()),
    }
}
