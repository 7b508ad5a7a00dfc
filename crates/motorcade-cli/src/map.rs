//! `motorcade map`: places that were kept.

use motorcade::{Config, Error, KeptMap, RunResult, merge_maps};
use motorcade_map::places_geojson;

use crate::arguments::{MapCommand, MapExportArguments, MapMergeArguments};
use crate::exit;
use crate::files::{Content, OutFile};

/// Answers about maps.
pub fn map(command: &MapCommand) -> anyhow::Result<u8> {
    match command {
        MapCommand::Info(arguments) => {
            let KeptMap { map, bytes, .. } = KeptMap::read(&arguments.map)?;
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
        MapCommand::Export(arguments) => export(arguments)?,
        MapCommand::Merge(arguments) => merge(arguments)?,
    }
    Ok(exit::FINE)
}

fn export(arguments: &MapExportArguments) -> anyhow::Result<()> {
    let wants = |name: &str| arguments.out.extension().is_some_and(|e| e.eq_ignore_ascii_case(name));
    let map = KeptMap::read(&arguments.map)?.map;
    let text = match (&arguments.start, wants("ply"), wants("geojson") || wants("json")) {
        (None, true, _) => map.to_ply(),
        (Some(start), _, true) => places_geojson(&map, start),
        (Some(_), true, _) => return Err(usage("--start belongs to a GeoJSON file: --out NAME.geojson")),
        (None, _, true) => {
            return Err(usage("a GeoJSON file needs --start: the map states no place on the earth"));
        }
        _ => return Err(usage("--out must end in .ply or .geojson")),
    };
    let file = OutFile::create(&arguments.out, Content::Landmarks)?;
    file.write(text)?;
    exit::say(&arguments.out.display().to_string());
    Ok(())
}

fn usage(problem: &str) -> anyhow::Error {
    Error::Config(problem.to_owned()).into()
}

fn merge(arguments: &MapMergeArguments) -> anyhow::Result<()> {
    let [first, second] = [&arguments.first, &arguments.second].map(|path| KeptMap::read(path));
    let (first, second) = (first?, second?);
    let file = OutFile::create(&arguments.out, Content::Map)?;
    let merged = merge_maps(&first.map, &second.map, &Config::default())?;
    file.write(merged.map.to_bytes())?;
    exit::print(&format!(
        "{} of {} keyframes see places of the first map; the second was bent by up to {:.2} m",
        merged.matches,
        second.map.keyframes.len(),
        merged.most_bent_m
    ))?;
    exit::say(&arguments.out.display().to_string());
    Ok(())
}

/// Writes the map of a result.
pub fn save(file: OutFile, result: &RunResult) -> anyhow::Result<()> {
    let why = "no places were kept: loops.enabled is false, or the camera's trajectory came from a file";
    let map = result.loops.map.as_ref().ok_or_else(|| Error::Config(why.into()))?;
    Ok(file.write(map.to_bytes())?)
}
