//! Renders a scenario into a folder in the layout of KITTI: `render SCENARIO FRAMES SEED FOLDER`.

use std::path::Path;
use std::time::Instant;

use motorcade_simulate::{RenderOptions, Scenario, WriteOptions, scenarios, simulate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, frames, seed, folder] = arguments.as_slice() else {
        let names: Vec<String> = scenarios().into_iter().map(|s| s.name).collect();
        return Err(
            format!("usage: render SCENARIO FRAMES SEED FOLDER; scenarios: {}", names.join(", ")).into()
        );
    };
    let scenario = Scenario::by_name(name).ok_or("no such scenario")?;
    let start = Instant::now();
    let drive = simulate(&scenario, frames.parse()?, seed.parse()?, &RenderOptions::default())?;
    let written = drive.write_kitti(Path::new(folder), &WriteOptions::default(), &|_| {})?;
    let spent = start.elapsed().as_secs_f64();
    #[allow(clippy::print_stdout, reason = "an example talks to its user")]
    {
        println!(
            "{}: {:.1} m, {} labels, {:.1} frames/s",
            written.training.display(),
            drive.length_m(),
            written.labels,
            drive.len() as f64 / spent
        );
    }
    Ok(())
}
