//! Speed of the renderer: `speed [SCENARIO...]` prints frames a CPU second, with and without writing files.

use std::path::Path;

use cpu_time::ProcessTime;
use motorcade_simulate::{RenderOptions, Renderer, Scenario, WriteOptions, simulate};

/// Frames per round.
const FRAMES: usize = 12;
/// Rounds, of which the fastest counts: other load only slows a round down.
const ROUNDS: usize = 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    if names.is_empty() {
        names = ["demo", "bends", "dense", "crowd"].map(String::from).to_vec();
    }
    let folder = std::env::temp_dir().join(format!("motorcade-speed-{}", std::process::id()));
    let mut lines =
        vec!["| scenario | frames a CPU second, rendered | and written |\n|---|---|---|".to_owned()];
    for name in &names {
        let scenario = Scenario::by_name(name).ok_or("no such scenario")?;
        let drive = simulate(&scenario, FRAMES, 1, &RenderOptions::default())?;
        let (mut rendered, mut written) = (f64::MAX, f64::MAX);
        for _ in 0..ROUNDS {
            // Scenery and textures are made once a drive, whatever its length.
            let start = ProcessTime::now();
            let renderer = Renderer::new(&drive);
            let making = start.elapsed().as_secs_f64();
            let start = ProcessTime::now();
            let seen = (0..FRAMES).filter_map(|i| renderer.render(i)).count();
            rendered = rendered.min(start.elapsed().as_secs_f64() / seen as f64);
            let start = ProcessTime::now();
            drive.write_kitti(Path::new(&folder), &WriteOptions::default(), &|_| {})?;
            written = written.min((start.elapsed().as_secs_f64() - making) / FRAMES as f64);
        }
        lines.push(format!("| {name} | {:.1} | {:.1} |", 1.0 / rendered, 1.0 / written));
    }
    std::fs::remove_dir_all(&folder)?;
    #[allow(clippy::print_stdout, reason = "an example talks to its user")]
    {
        println!("{}", lines.join("\n"));
    }
    Ok(())
}
