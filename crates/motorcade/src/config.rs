//! The configuration of a run: works with none, refuses what it does not know.

use std::sync::OnceLock;

use motorcade_calibrate::CalibrateOptions;
use motorcade_multibody::{CameraCoupling, GraphOptions, LoopOptions};
use motorcade_odometry::{
    AdvancedClosedFormOptions, MetricOptions, OdometryOptions, RoadOptions, ScaleAverage,
};
use motorcade_perception::DetectorOptions;
use motorcade_places::PlaceOptions;
use motorcade_vehicles::{TrackerOptions, VehicleOptions};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::check_options::CheckOptions;
use crate::error::{Error, Result};
use crate::estimator_options::{DistanceOptions, OnlineOptions, UnitOptions, VehicleHeightOptions};
use crate::output_options::OutputOptions;
use crate::setting_names::{ADVANCED, current};

/// Ready-made configurations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// The best known configuration.
    #[default]
    Default,
    /// The method of Nair et al. 2020: fixed road normal, mean of closed-form scales of road points nearer than 12 m.
    Paper,
}

/// Regions masked for the camera's own motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum VehicleMask {
    /// Every box of a vehicle.
    All,
    /// Boxes of vehicles that have not shown that they stand.
    #[default]
    Moving,
    /// Nothing.
    None,
}

/// Options of the run as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RunOptions {
    /// Share of frames without a tracked pose above which the run counts as failed (exit code 4).
    pub most_untracked: f64,
    /// Regions masked for the camera's own motion.
    pub vehicle_mask: VehicleMask,
    /// False ignores road masks: the road is then found from geometry.
    pub road_mask: bool,
    /// True looks for what is fixed to the camera (bonnet, reflections) and leaves it out.
    pub fixed_regions: bool,
    /// Time after which the checkpoint of a run is forced onto the disk, and the state of odometry and road written beside it \[s\]: as much of
    /// them a resumed run computes again, and as much of its networks' work a failure of the whole machine costs. The end of the program
    /// alone costs the networks a frame. Shorter times write more often, 0 after every frame.
    pub checkpoint_s: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for RunOptions {
    fn default() -> Self {
        // A fifth of the frames: gaps of a second in five can still be bridged sensibly, more cannot.
        Self {
            most_untracked: 0.2,
            vehicle_mask: VehicleMask::Moving,
            road_mask: true,
            fixed_regions: true,
            checkpoint_s: 60.0,
            seed: 1,
        }
    }
}

/// Options of the metric scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScaleOptions {
    /// False measures nothing on the road: metres then come from another sensor alone (`--speed`, `--gps`), and the unit of the odometry
    /// is not held between its distances.
    pub road: bool,
    /// The paper's closed form instead of aligning the road.
    pub closed_form: bool,
    /// True uses the closed form of a frame in which the road was not aligned. Costs the tracking of its corners; level asphalt without
    /// texture is bridged, hills and crowns enter by the fixed plane.
    pub points: bool,
    /// Farthest road point of the closed form \[m\] (the paper's T).
    pub farthest_m: f64,
    /// Average over the scales of all matches of the closed form.
    pub average: ScaleAverage,
    /// False takes each frame's scale as it was measured, as the paper does.
    pub smoothed: bool,
    /// Height of the camera by vehicles.
    pub height: VehicleHeightOptions,
    /// Distances by another sensor.
    pub distances: DistanceOptions,
    /// Scale and road over time, matches of the closed form, the unit of an external trajectory.
    pub advanced: AdvancedScaleOptions,
}

/// Scale and road over time, matches of the closed form, the unit of an external trajectory. Names that it does not know are refused by
/// [`Config::overlay`], because flattened fields exclude serde's own check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct AdvancedScaleOptions {
    /// Metric scale and road over time.
    #[serde(flatten)]
    pub metric: MetricOptions,
    /// Road corners of the closed form and their matches.
    pub matching: AdvancedClosedFormOptions,
    /// Unit of an external trajectory, from static vehicles.
    pub unit: UnitOptions,
}

impl Default for ScaleOptions {
    fn default() -> Self {
        Self {
            road: true,
            closed_form: false,
            points: false,
            farthest_m: 12.0,
            average: ScaleAverage::Mean,
            smoothed: true,
            height: VehicleHeightOptions::default(),
            distances: DistanceOptions::default(),
            advanced: AdvancedScaleOptions::default(),
        }
    }
}

/// Everything that can be set, by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Preset the rest started from.
    pub preset: Preset,
    /// The run as a whole.
    pub run: RunOptions,
    /// Checks of what goes in.
    pub checks: CheckOptions,
    /// Lens of a camera that nobody calibrated (`calibrate`, `run --calibration auto`).
    pub calibration: CalibrateOptions,
    /// Detectors: boxes, crops, what is fixed to the camera.
    pub perception: DetectorOptions,
    /// Odometry.
    pub odometry: OdometryOptions,
    /// Road plane.
    pub road: RoadOptions,
    /// Metric scale.
    pub scale: ScaleOptions,
    /// Identities.
    pub tracker: TrackerOptions,
    /// Vehicles.
    pub vehicles: VehicleOptions,
    /// Multi-object graph.
    pub graph: GraphOptions,
    /// Recognition of places.
    pub places: PlaceOptions,
    /// Loops, of drives that are estimated as a whole.
    pub loops: LoopOptions,
    /// Online runs.
    pub online: OnlineOptions,
    /// Tables and report.
    pub outputs: OutputOptions,
}

impl Config {
    /// A preset.
    pub fn preset(preset: Preset) -> Self {
        let base = Self { preset, ..Self::default() };
        match preset {
            Preset::Default => base,
            Preset::Paper => Self {
                scale: ScaleOptions { closed_form: true, smoothed: false, ..base.scale },
                loops: LoopOptions { enabled: false, ..base.loops },
                graph: GraphOptions { constant_weights: true, camera: CameraCoupling::Free, ..base.graph },
                ..base
            },
        }
    }

    /// Overlays a configuration file on this configuration: TOML, or the JSON of a `run.json`, whose `configuration` counts.
    ///
    /// # Errors
    /// Text that does not parse, an unknown key (the nearest known one is named), a value of the wrong kind.
    pub fn overlay(self, text: &str, origin: &str) -> Result<Self> {
        let problem = |e: &dyn std::fmt::Display| Error::Config(format!("{origin}: {e}"));
        let table: Table = if text.trim_start().starts_with('{') {
            let record: serde_json::Value = serde_json::from_str(text).map_err(|e| problem(&e))?;
            let configuration = record.get("configuration").unwrap_or(&record);
            let mut table = Table::try_from(configuration).map_err(|e| problem(&e))?;
            REMOVED.iter().for_each(|path| remove(&mut table, path));
            table
        } else {
            text.parse().map_err(|e| problem(&e))?
        };
        self.overlay_table(&table, origin)
    }

    /// Overlays one `stage.key=value`.
    ///
    /// # Errors
    /// As [`Config::overlay`].
    pub fn set(self, assignment: &str) -> Result<Self> {
        let Some((key, value)) = assignment.split_once('=') else {
            return Err(Error::Config(format!("--set {assignment}: expected stage.key=value")));
        };
        let (key, value) = (key.trim(), value.trim());
        // Bare words are strings: `vehicles.traffic_side=left` needs no quotes.
        let parsed = format!("v = {value}").parse::<Table>().ok().and_then(|mut t| t.remove("v"));
        let mut node = parsed.unwrap_or_else(|| Value::String(value.to_owned()));
        for part in key.rsplit('.') {
            node = Value::Table(Table::from_iter([(part.to_owned(), node)]));
        }
        let Value::Table(table) = node else {
            return Err(Error::Config(format!("--set {assignment}: no key")));
        };
        self.overlay_table(&table, &format!("--set {assignment}"))
    }

    fn overlay_table(self, table: &Table, origin: &str) -> Result<Self> {
        let mut whole = Table::try_from(self).map_err(|e| Error::Config(e.to_string()))?;
        let named = current(table, &whole, origin)?;
        merge(&mut whole, &named, "", origin)?;
        let config: Self = whole.try_into().map_err(|e| Error::Config(format!("{origin}: {e}")))?;
        config.validate().map_err(|problem| Error::Config(format!("{origin}: {problem}")))?;
        Ok(config)
    }

    /// Every count at most a hundred times its default, or 1000; every other number finite and at most 1e9.
    fn validate_numbers(&self) -> std::result::Result<(), String> {
        static DEFAULT: OnceLock<std::result::Result<Table, String>> = OnceLock::new();
        let table = |config: &Self| Table::try_from(*config).map_err(|e| e.to_string());
        let default = DEFAULT.get_or_init(|| table(&Self::default())).as_ref().map_err(Clone::clone)?;
        validate_table("", &table(self)?, default)
    }

    pub(crate) fn validate(&self) -> std::result::Result<(), String> {
        self.validate_numbers()?;
        let check = |ok: bool, text: &str| if ok { Ok(()) } else { Err(text.to_owned()) };
        check((0.0..=1.0).contains(&self.run.most_untracked), "run.most_untracked must lie between 0 and 1")?;
        self.checks.validate()?;
        self.perception.validate()?;
        self.odometry.validate()?;
        self.calibration.validate().map_err(|problem| format!("calibration.{problem}"))?;
        check(self.road.far_heights > 4.0, "road.far_heights must be more than 4")?;
        check(self.road.half_width_heights > 0.3, "road.half_width_heights must be more than 0.3")?;
        check(
            self.road.unmasked_half_width_heights > 0.3,
            "road.unmasked_half_width_heights must be more than 0.3",
        )?;
        let road = &self.road.advanced;
        check(road.baseline_heights > 0.05, "road.advanced.baseline_heights must be more than 0.05")?;
        check(road.oldest_s > 0.0, "road.advanced.oldest_s must be more than 0")?;
        check((0.0..=0.2).contains(&self.road.readout_s), "road.readout_s must lie between 0 and 0.2")?;
        road.height.validate().map_err(|problem| format!("road.advanced.height.{problem}"))?;
        check(
            self.scale.farthest_m > 5.0,
            "scale.farthest_m must be more than 5 (the road nearer is hidden)",
        )?;
        check(self.run.checkpoint_s >= 0.0, "run.checkpoint_s must not be negative")?;
        check(self.online.lag_s > 0.0, "online.lag_s must be more than 0")?;
        check(self.online.scale_s > 0.0, "online.scale_s must be more than 0")?;
        check(self.online.interval_s >= 0.0, "online.interval_s must not be negative")?;
        let online = &self.online.advanced;
        check(online.forget_after_s >= 1.0, "online.advanced.forget_after_s must be at least 1")?;
        check(
            online.least_corrected_keyframes > 0,
            "online.advanced.least_corrected_keyframes must be at least 1",
        )?;
        check(online.most_visits > 0, "online.advanced.most_visits must be at least 1")?;
        check(self.scale.distances.clock_sigma_s > 0.0, "scale.distances.clock_sigma_s must be positive")?;
        self.graph.validate()?;
        self.places.validate()?;
        self.loops.validate()?;
        self.vehicles.validate()?;
        self.outputs.validate()?;
        let tracker = &self.tracker;
        check((0.0..=1.0).contains(&tracker.least_iou), "tracker.least_iou must lie between 0 and 1")?;
        check(
            (0.0..=1.0).contains(&tracker.advanced.least_standing_overlap),
            "tracker.advanced.least_standing_overlap must lie between 0 and 1",
        )
    }
}

/// Settings that earlier versions wrote into `run.json` and that follow from others now, or have no effect; a run of an earlier version can be repeated.
const REMOVED: [&str; 7] = [
    "checks.focal_length.settling_keyframes",
    "loops.most_correlated_frames",
    "scale.advanced.profile.reach_heights",
    "vehicles.advanced.hypothesis.least_mean_score",
    "vehicles.advanced.keypoints.fit.advanced.box_edge_scale",
    "vehicles.advanced.keypoints.fit.advanced.box_edge_sigma_px",
    "vehicles.advanced.keypoints.fit.advanced.box_edge_share",
];

fn remove(table: &mut Table, path: &str) {
    match path.split_once('.') {
        None => drop(table.remove(path)),
        Some((key, rest)) => {
            if let Some(Value::Table(inner)) = table.get_mut(key) {
                remove(inner, rest);
            }
        }
    }
}

fn validate_table(path: &str, table: &Table, default: &Table) -> std::result::Result<(), String> {
    for (key, value) in table {
        let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let default = default.get(key);
        if let (Value::Table(inner), Some(Value::Table(default))) = (value, default) {
            validate_table(&full, inner, default)?;
        } else if key != "seed" {
            validate_number(&full, value, default.and_then(Value::as_integer).unwrap_or(0))?;
        }
    }
    Ok(())
}

fn validate_number(path: &str, value: &Value, default: i64) -> std::result::Result<(), String> {
    const LARGEST: f64 = 1e9;
    let most = default.saturating_mul(100).max(1000);
    match value {
        Value::Integer(v) if !(0..=most).contains(v) => {
            Err(format!("{path} must lie between 0 and {most}, got {v}"))
        }
        Value::Float(v) if v.is_nan() || v.abs() > LARGEST => {
            Err(format!("{path} must be finite and at most {LARGEST:e}, got {v:e}"))
        }
        Value::Array(values) => values.iter().try_for_each(|v| validate_number(path, v, default)),
        _ => Ok(()),
    }
}

fn merge(into: &mut Table, from: &Table, path: &str, origin: &str) -> Result<()> {
    for (key, value) in from {
        let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let Some(slot) = into.get_mut(key) else { return Err(unknown(into, key, path, origin)) };
        match (slot, value) {
            (Value::Table(slot), Value::Table(value)) => merge(slot, value, &full, origin)?,
            // `8` is a fine way to write 8.0.
            (slot @ Value::Float(_), Value::Integer(v)) => *slot = Value::Float(*v as f64),
            (slot, value) if slot.same_type(value) => *slot = value.clone(),
            (slot, value) => {
                let problem = format!("{full} must be a {}, not {value}", slot.type_str());
                return Err(Error::Config(format!("{origin}: {problem}")));
            }
        }
    }
    Ok(())
}

fn unknown(table: &Table, key: &str, path: &str, origin: &str) -> Error {
    let alike = |name: &str| strsim::jaro_winkler(name, key);
    let advanced = table.get(ADVANCED).and_then(Value::as_table);
    let below = advanced.into_iter().flat_map(Table::keys).map(|name| (alike(name), ADVANCED, name));
    let here = table.keys().map(|name| (alike(name), "", name));
    let nearest = below.chain(here).max_by(|a, b| a.0.total_cmp(&b.0));
    let place = if path.is_empty() { "at the top".to_owned() } else { format!("in `{path}`") };
    let dot = |section: &str| if section.is_empty() { "" } else { "." };
    let hint =
        nearest.map(|(_, s, name)| format!("; did you mean `{s}{}{name}`?", dot(s))).unwrap_or_default();
    Error::Config(format!("{origin}: unknown key `{key}` {place}{hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_vehicles::TrafficSide;

    #[test]
    fn settings_overlay_and_unknown_keys_name_the_nearest() {
        let config = Config::default().set("odometry.advanced.policy.keyframe_flow_rad=0.03").unwrap();
        assert_eq!(config.odometry.advanced.policy.keyframe_flow_rad, 0.03);
        let config = config.set("vehicles.traffic_side=left").unwrap();
        assert_eq!(config.vehicles.traffic_side, TrafficSide::Left);
        let error = config.set("odometry.advanced.policy.keyframe_flow=1").unwrap_err().to_string();
        assert!(error.contains("did you mean `keyframe_flow_rad`?"), "{error}");
        let error = config.overlay("[roda]\nfar_heights = 3.0", "my.toml").unwrap_err().to_string();
        assert!(error.contains("my.toml") && error.contains("`road`"), "{error}");
        assert!(config.set("road.far_heights=far").is_err());
        for assignment in [
            "odometry.klt.max_iterations=1000000000",
            "odometry.klt.advanced.pyramid_levels=4000000000",
            "road.advanced.oldest_s=1e300",
            "road.advanced.oldest_s=nan",
            "scale.advanced.smoother.drifts=[0.1, inf, 0.1, 0.1, 0.1, 0.1, 0.1]",
        ] {
            let error = config.set(assignment).unwrap_err().to_string();
            let key = assignment.split_once('=').unwrap().0;
            assert!(error.contains(&format!("{key} must")), "{error}");
        }
        assert!(config.set("run.seed=9000000000000").is_ok());
        assert!(config.set("road.far_heights=1").unwrap_err().to_string().contains("more than 4"));
        for (setting, problem) in [
            ("odometry.corners.columns=2", "odometry.corners.columns must lie between 4 and 200"),
            ("odometry.advanced.pose.kernel_px=0", "odometry.advanced.pose.kernel_px must be positive"),
            ("odometry.advanced.window.depth_neighbours=17", "must lie between 1 and 16"),
            ("road.advanced.height.step=1e-9", "road.advanced.height.step must lie between 0.001 and 0.2"),
            (
                "tracker.advanced.least_standing_overlap=1.2",
                "tracker.advanced.least_standing_overlap must lie between 0 and 1",
            ),
            (
                "vehicles.advanced.met_again.least_together_s=-0.1",
                "vehicles.advanced.met_again.least_together_s must not be negative",
            ),
            ("road.readout_s=-0.01", "road.readout_s must lie between 0 and 0.2"),
            ("odometry.readout_s=30", "odometry.readout_s must lie between 0 and 0.2"),
            ("road.advanced.height.mirror.patch_px=0", "road.advanced.height.mirror.patch_px must lie"),
            ("road.advanced.height.range_units=[2, 1]", "road.advanced.height.range_units must be two"),
            ("vehicles.advanced.keypoints.fit.deformations=9", "must be at most 8"),
        ] {
            let error = config.set(setting).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }

    #[test]
    fn the_resolved_configuration_reads_back() {
        let config = Config::preset(Preset::Paper);
        let text = toml::to_string(&config).unwrap();
        assert_eq!(Config::default().overlay(&text, "copy").unwrap(), config);
        let record = serde_json::json!({ "configuration": config }).to_string();
        assert_eq!(Config::default().overlay(&record, "run.json").unwrap(), config);
    }

    #[test]
    fn a_record_of_an_earlier_version_reads_and_a_file_with_its_settings_does_not() {
        for path in REMOVED {
            let (table, key) = path.rsplit_once('.').unwrap();
            let mut node = serde_json::json!({ key: 7 });
            for part in table.rsplit('.') {
                node = serde_json::json!({ part: node });
            }
            let record = serde_json::json!({ "configuration": node }).to_string();
            assert_eq!(Config::default().overlay(&record, "run.json").unwrap(), Config::default());
            assert!(Config::default().overlay(&format!("[{table}]\n{key} = 7"), "my.toml").is_err());
        }
    }
}
