//! `motorcade export`: a run on the map and as a scenario.

use std::fs;
use std::path::Path;

use motorcade::output::{OutputDirectory, io_error};
use motorcade::{Error, RecordedRun, RunRecord};
use motorcade_dataset::{Geodetic, GpsTrack};
use motorcade_map::{AlignOptions, Alignment, Anchor, Placed, Scenario, ScenarioOptions, align};

use crate::arguments::ExportArguments;
use crate::drive::command_line;
use crate::exit;

/// Record of an export, which lists its files.
const RECORD: &str = "export.json";
/// Without a place on the earth the first camera looks along the x axis of the scenario.
const EAST_DEG: f64 = 90.0;

/// A run's place, and how it was found.
struct Found {
    anchor: Anchor,
    /// Of a GPS track.
    alignment: Option<Alignment>,
    /// False when no place was given.
    on_earth: bool,
}

/// Writes the files.
pub fn export(arguments: &ExportArguments) -> anyhow::Result<u8> {
    let record = RunRecord::read(&arguments.run)?;
    let run = RecordedRun::read(&arguments.run)?;
    let own = |problem: &str| Error::Input(format!("{}: {problem}", arguments.run.display()));
    let height_m =
        record.camera_height_m.ok_or_else(|| own("its run.json states no height of the camera"))?;
    let directory = OutputDirectory::open(&arguments.out, RECORD, arguments.force)?;
    let found = find(arguments, &run)?;
    let placed = Placed::new(&run, found.anchor).ok_or_else(|| own("the run has no frames"))?;
    directory
        .write(|folder| write(folder, &found, &placed, height_m), |files, ()| record_of(&found, files))?;
    exit::say(&found.describe());
    exit::say(&arguments.out.display().to_string());
    Ok(exit::FINE)
}

fn find(arguments: &ExportArguments, run: &RecordedRun) -> anyhow::Result<Found> {
    if let Some(path) = &arguments.track {
        let alignment = align(run, &GpsTrack::read(path)?, arguments.clock_offset, &AlignOptions::default())?;
        return Ok(Found { anchor: alignment.anchor, alignment: Some(alignment), on_earth: true });
    }
    let nowhere = Anchor {
        start: Geodetic { latitude_deg: 0.0, longitude_deg: 0.0, altitude_m: 0.0 },
        heading_deg: EAST_DEG,
        sigma: None,
        clock_offset_s: None,
    };
    Ok(Found {
        anchor: arguments.start.unwrap_or(nowhere),
        alignment: None,
        on_earth: arguments.start.is_some(),
    })
}

fn write(folder: &Path, found: &Found, placed: &Placed<'_>, height_m: f64) -> anyhow::Result<()> {
    let put = |name: &str, text: String| {
        let path = folder.join(name);
        fs::write(&path, text).map_err(|e| io_error(&path, &e))
    };
    put("drive.xosc", motorcade_map::xosc(&Scenario::new(placed, height_m, &ScenarioOptions::default())))?;
    if found.on_earth {
        put("drive.geojson", motorcade_map::geojson(placed))?;
        put("drive.gpx", motorcade_map::gpx(placed))?;
        put("drive.kml", motorcade_map::kml(placed))?;
        put("ego.oxts.csv", motorcade_map::oxts(placed))?;
    }
    Ok(())
}

fn record_of(found: &Found, files: &[motorcade::output::ListedFile]) -> serde_json::Value {
    let a = &found.anchor;
    let place = found.on_earth.then(|| {
        serde_json::json!({
            "latitude_deg": a.start.latitude_deg,
            "longitude_deg": a.start.longitude_deg,
            "altitude_m": a.start.altitude_m,
            "heading_deg": a.heading_deg,
            "sigma_position_m": a.sigma.map(|s| s.0),
            "sigma_heading_deg": a.sigma.map(|s| s.1),
            "clock_offset_s": a.clock_offset_s,
            "sigma_clock_offset_s": found.alignment.map(|m| m.clock_sigma_s),
            "rms_m": found.alignment.map(|m| m.rms_m),
            "fixes": found.alignment.map(|m| m.fixes.0),
            "outliers": found.alignment.map(|m| m.fixes.1),
        })
    });
    serde_json::json!({
        "motorcade": env!("CARGO_PKG_VERSION"),
        "command": command_line(),
        "start": place,
        "files": files,
    })
}

impl Found {
    fn describe(&self) -> String {
        let (a, Some(m)) = (&self.anchor, self.alignment) else {
            let where_from =
                if self.on_earth { "placed by --start" } else { "no place on the earth: drive.xosc alone" };
            return where_from.to_owned();
        };
        let (position, heading) = a.sigma.unwrap_or_default();
        format!(
            "start {:.6}, {:.6} ± {position:.1} m, heading {:.1} ± {heading:.1}°, clock {:+.2} ± {:.2} s; {} fixes, {} outliers, \
             rms {:.1} m",
            a.start.latitude_deg,
            a.start.longitude_deg,
            a.heading_deg,
            a.clock_offset_s.unwrap_or_default(),
            m.clock_sigma_s,
            m.fixes.0,
            m.fixes.1,
            m.rms_m
        )
    }
}
