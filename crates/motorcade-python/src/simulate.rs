//! Simulated drives.

use std::path::PathBuf;

use motorcade::Progress;
use motorcade::output::OutputDirectory;
use motorcade_simulate::{
    DRIVE_RECORD, KeypointOptions, RenderOptions, Scenario, SensorOptions, Weather, WriteOptions, Written,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Failure;
use crate::supervise::{Watch, supervised};

/// Arguments of a simulation as the package hands them over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SimulateArguments {
    scenario: String,
    out: PathBuf,
    frames: usize,
    fps: f64,
    seed: u64,
    width: u32,
    weather: String,
    exposure_drift: f64,
    blur_samples: usize,
    shutter_s: f64,
    readout_ms: f64,
    depth: bool,
    instance: bool,
    keypoints: bool,
    force: bool,
    /// For the record.
    command: Vec<String>,
}

/// Names and descriptions of the scenarios.
#[pyfunction]
pub fn scenarios() -> Vec<(String, String)> {
    motorcade_simulate::scenarios().into_iter().map(|s| (s.name, s.description)).collect()
}

/// Renders a scenario into a folder in the shape of KITTI tracking.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    arguments: SimulateArguments,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let written = supervised(py, progress.as_ref(), move |watch| arguments.write(watch))?;
    let out = PyDict::new(py);
    out.set_item("training", written.training)?;
    out.set_item("sequence", written.sequence)?;
    out.set_item("detections", written.detections)?;
    out.set_item("road_masks", written.road_masks)?;
    out.set_item("keypoints", written.keypoints)?;
    out.set_item("labels", written.labels)?;
    Ok(out)
}

impl SimulateArguments {
    fn write(self, watch: &Watch) -> Result<Written, Failure> {
        let known = |names: Vec<String>| format!("known are {}", names.join(", "));
        let Some(scenario) = Scenario::by_name(&self.scenario) else {
            let names = known(scenarios().into_iter().map(|(name, _)| name).collect());
            return Err(Failure::settings(format!("unknown scenario `{}`; {names}", self.scenario)));
        };
        let Some(weather) = Weather::ALL.into_iter().find(|w| w.name() == self.weather) else {
            let names = known(Weather::ALL.map(|w| w.name().to_owned()).to_vec());
            return Err(Failure::settings(format!("unknown weather `{}`; {names}", self.weather)));
        };
        for (what, value, least, most) in [
            ("fps", self.fps, 2.0, 60.0),
            ("width", f64::from(self.width), 16.0, 8192.0),
            ("frames", self.frames as f64, 0.0, 1e5),
            ("blur_samples", self.blur_samples as f64, 1.0, 256.0),
        ] {
            if !(least..=most).contains(&value) {
                return Err(Failure::settings(format!("{what} must lie in [{least}, {most}], got {value}")));
            }
        }
        let sensor = SensorOptions {
            exposure_drift: self.exposure_drift,
            blur_samples: self.blur_samples,
            shutter_s: self.shutter_s,
            readout_s: 1e-3 * self.readout_ms,
            ..SensorOptions::default()
        };
        let render = RenderOptions { weather, sensor, fps: self.fps, ..RenderOptions::default() };
        let drive =
            motorcade_simulate::simulate(&scenario, self.frames, self.seed, &render.with_width(self.width))?;
        let options = WriteOptions {
            depth: self.depth,
            instance: self.instance,
            keypoints: self.keypoints.then(KeypointOptions::default),
            ..WriteOptions::default()
        };
        let directory = OutputDirectory::open(&self.out, DRIVE_RECORD, self.force)?;
        watch.begin("rendering", Some(drive.len()));
        directory.write(
            |folder| {
                let (advance, cancelled) = (|done| watch.advance(done), || watch.cancelled());
                let written = drive.write_kitti_until(folder, &options, &advance, &cancelled)?;
                Ok(written.moved(folder, &self.out))
            },
            |files, _| {
                let version = env!("CARGO_PKG_VERSION");
                serde_json::json!({"motorcade": version, "command": self.command, "files": files})
            },
        )
    }
}
