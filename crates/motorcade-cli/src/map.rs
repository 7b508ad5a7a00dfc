//! `motorcade map`: places that were kept.

use std::path::Path;

use motorcade::{Error, PlaceMap, RunResult};
use motorcade_dataset::regular_file;

use crate::arguments::MapCommand;
use crate::exit;
use crate::files::OutFile;

/// Answers about maps.
pub fn map(command: &MapCommand) -> anyhow::Result<u8> {
    match command {
        MapCommand::Info(arguments) => {
            let (map, bytes) = read(&arguments.map)?;
            let summary = map.summary();
            exit::print(&format!("keyframes          {}", summary.keyframes))?;
            exit::print(&format!("landmarks          {}", summary.landmarks))?;
            exit::print(&format!("maps not joined    {}", summary.segments))?;
            exit::print(&format!("way                {:.1} m", summary.way_m))?;
            exit::print(&format!(
                "bytes              {bytes}, {:.0} a metre",
                bytes as f64 / summary.way_m.max(1e-9)
            ))?;
            let (c, height_m) = (map.camera, map.height_m);
            exit::print(&format!(
                "camera             {}x{}, fx {:.1}, {height_m:.2} m above the road",
                c.width, c.height, c.fx
            ))?;
        }
        MapCommand::Export(arguments) => {
            let file = OutFile::create(&arguments.out)?;
            file.write(read(&arguments.map)?.0.to_ply())?;
            exit::say(&arguments.out.display().to_string());
        }
    }
    Ok(exit::FINE)
}

/// A map and its size [bytes].
fn read(path: &Path) -> Result<(PlaceMap, usize), Error> {
    let problem = |e: &dyn std::fmt::Display| Error::Input(format!("{}: {e}", path.display()));
    let bytes = regular_file::read(path).map_err(|e| problem(&e))?;
    Ok((PlaceMap::from_bytes(&bytes).map_err(|e| problem(&e))?, bytes.len()))
}

/// Writes the map of a result.
pub fn save(file: OutFile, result: &RunResult) -> anyhow::Result<()> {
    let why = "no places were kept: loops.enabled is false, or the camera's trajectory came from a file";
    let map = result.loops.map.as_ref().ok_or_else(|| Error::Config(why.into()))?;
    Ok(file.write(map.to_bytes())?)
}
