//! Results of the estimator over the last seconds.

use motorcade_graph::Stop;
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::VehicleTrajectory;

use super::SlidingEstimator;
use crate::assembly::Estimated;
use crate::estimate::{Estimate, VehicleEstimate};
use crate::estimator::unit::Unit;
use crate::progress::{Progress, stopped_after_frames};
use crate::record::{FrontEndRecord, FrontEndView};
use crate::result::RunResult;
use crate::settings::Settings;

impl SlidingEstimator {
    /// The estimate of the newest frame taken; `None` before the first.
    pub fn newest(&self, view: &FrontEndView<'_>) -> Option<Estimate> {
        let row = self.ego.len().checked_sub(1)?;
        let (ego, frame) = (self.ego.get(row)?, view.frames.get(row)?);
        let newest = |v: &VehicleTrajectory| {
            let state = v.states.last().filter(|s| s.frame == row)?.clone();
            let VehicleTrajectory { id, class, size, size_covariance, p_moving, .. } = *v;
            Some(VehicleEstimate { id, class, size, size_covariance, p_moving, state })
        };
        let mut vehicles: Vec<VehicleEstimate> = self.vehicles.values().filter_map(newest).collect();
        let mut ego = ego.clone();
        if let Some(loops) = &self.loops {
            loops.offsets.newest(row, &mut ego, vehicles.iter_mut().map(|v| &mut v.state));
        }
        Some(Estimate {
            frame: frame.clone(),
            ego,
            speed_mps: self.speeds_mps.last().copied().unwrap_or_default(),
            vehicles,
        })
    }

    /// Ends the drive: every frame and vehicle as it was estimated when it came.
    pub fn finish(
        mut self,
        mut record: FrontEndRecord,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> RunResult {
        let stop = stopped_after_frames(record.interrupted, progress);
        record.stopwatch.join(&self.stopwatch);
        let unknown = settings.height_unknown.then(|| {
            format!(
                "height of the camera guessed, {:.2} m: it is estimated at the end of a drive only",
                settings.height_m
            )
        });
        let unit = self.unit.iter().map(Unit::to_string);
        let (mut frames, lost) = self.ego.into_frames();
        let states_lost = self.archive.give_back(&mut self.vehicles);
        let (loops, places_lost) = self.loops.take().map_or_else(Default::default, |loops| {
            let states = self.vehicles.values_mut().flat_map(|v| &mut v.states);
            loops.offsets.all(&mut frames, states);
            loops.finish(settings, Stop::new(&stop))
        });
        if stop() {
            record.end_early();
        }
        let by_loops = loops.describe();
        let warnings = self.warnings.into_iter().chain(unit).chain(unknown).chain(by_loops);
        let warnings = lost.into_iter().chain(states_lost).chain(places_lost).chain(warnings).collect();
        let estimated = Estimated {
            camera: settings.camera,
            ego: EgoTrajectory { frames, height_m: settings.height_m, noise: Vec::new() },
            vehicles: self.vehicles.into_values().collect(),
            graph: None,
            loops,
            warnings,
            metric: settings.metric() || self.unit.is_some(),
            speeds_mps: Some(self.speeds_mps),
        };
        RunResult::new(record, estimated, &settings.config.checks, progress)
    }
}
