//! Places seen again, or known from a kept map, while the camera drives.
//!
//! The estimator over the last seconds goes on in its own world, which drifts. Loops are closed among the keyframes of places alone, and
//! their correction is a move of that world ([`Offsets`]) from the frame on at which it became known. A correction solves the keyframes
//! since the last places that were seen again, and some hundreds at least; earlier ones are held as those of a kept map are, so that a
//! correction costs the same after an hour. Those before are [`settled`]: what only the end needs of them waits in temporary files, and of a
//! place that is visited often the features of the first visits alone stay.

mod guessed;
mod offsets;
mod settled;
mod state;

use motorcade_geometry::{Camera, Pose, World};
use motorcade_graph::Stop;
use motorcade_multibody::{LoopReport, LoopSolve, MapEdge, PlaceEdges, close_loops};
use motorcade_odometry::{EgoFrame, EgoTrajectory, Rows, Uncertainty};
use motorcade_places::{FramePlacement, PlaceMap, PlaceMatch, PlaceSearch, place_keyframe};
use nalgebra::Matrix6;

use self::guessed::{guessed, rescale};
use self::offsets::Offsets;
use self::settled::Settled;
use super::loops::{join, search_with_map, within_drift};
use super::place_edges::{KnownPose, Matched, Verdict};
use crate::archive::not_read_back;
use crate::closed_loop::Loops;
use crate::estimator_options::AdvancedOnlineOptions;
use crate::kept_map::MapUse;
use crate::record::{FrontEndView, mean_interval_between};
use crate::revision::{RevisedKeyframe, Revision};
use crate::settings::Settings;

pub(super) use state::OnlineLoopsState;

/// The solve of keyframes taken at these times.
fn solve<'a>(settings: &'a Settings, times_ns: &[i64], stop: Stop<'a>) -> LoopSolve<'a> {
    let ends = times_ns.first().zip(times_ns.last());
    let interval_s = mean_interval_between(ends.map(|(first, last)| [*first, *last]), times_ns.len());
    LoopSolve { graph: &settings.config.graph, interval_s, threads: settings.threads, stop }
}

/// Places seen again while the camera drives.
pub(super) struct OnlineLoops {
    /// Keyframes of the kept map, then those of the drive.
    search: PlaceSearch,
    /// Number of keyframes of the kept map.
    of_map: usize,
    /// Cameras of the rows that keyframes to come need.
    ego: Rows<EgoFrame>,
    /// Way driven to each row \[m\].
    way_m: Rows<f64>,
    /// Cameras of the keyframes; the step to each goes from the one before.
    trajectory: Rows<EgoFrame>,
    /// Times of the keyframes \[ns\].
    times_ns: Vec<i64>,
    /// Matches that the last correction was made of, with its verdicts, in order of their later keyframes.
    judged: Vec<(PlaceMatch, Verdict)>,
    /// Poses of the keyframes by the last correction.
    corrected: Rows<KnownPose>,
    settled: Settled,
    /// Way at the last correction \[m\].
    corrected_m: f64,
    /// Pose of each keyframe as reported last.
    reported: Rows<Pose<World, Camera>>,
    pub(super) offsets: Offsets,
    pub(super) loops: Loops,
    revisions: usize,
}

impl OnlineLoops {
    /// For runs that look for loops as they go; `None` for others.
    pub(super) fn new(settings: &Settings) -> Option<Self> {
        let config = &settings.config;
        let wanted = config.online.enabled && config.loops.enabled && settings.external.trajectory.is_none();
        wanted.then(|| Self {
            search: search_with_map(settings).keeping_visits(config.online.advanced.most_visits),
            of_map: settings.external.map.as_ref().map_or(0, |kept| kept.map.keyframes.len()),
            ego: Rows::default(),
            way_m: Rows::default(),
            trajectory: Rows::default(),
            times_ns: Vec::new(),
            judged: Vec::new(),
            corrected: Rows::default(),
            settled: Settled::default(),
            corrected_m: f64::NEG_INFINITY,
            reported: Rows::default(),
            offsets: Offsets::default(),
            loops: Loops { kept: settings.external.map.as_ref().map(MapUse::of), ..Loops::default() },
            revisions: 0,
        })
    }

    /// Number of keyframes of the drive.
    fn own(&self) -> usize {
        self.search.keyframes().len() - self.of_map
    }

    /// Number of keyframes whose features are not needed any more.
    pub(super) fn done(&self, settings: &Settings) -> usize {
        self.own().saturating_sub(settings.config.places.advanced.landmarks.neighbours)
    }

    /// Takes the newest row and the keyframes that became complete with it; returns the correction where there is one.
    pub(super) fn advance(
        &mut self,
        view: &FrontEndView<'_>,
        newest: &EgoFrame,
        settings: &Settings,
    ) -> Option<Revision> {
        self.push(newest, settings);
        let options = &settings.config.online.advanced;
        let reach = settings.config.places.advanced.landmarks.neighbours;
        let before = self.own();
        while self.own() + reach < view.places.len() && !self.waits(newest, view, settings) {
            self.take(view, settings)?;
        }
        let taken = self.own() > before;
        if !taken || self.search.report().verified == 0 {
            return None;
        }
        let newest_m = *self.way_m.last()?;
        let first = self.first_moved(options);
        let mut matches =
            self.search.supported_since(self.of_map + first.saturating_sub(options.overlap_keyframes));
        matches.retain(|m| m.query >= self.of_map + first);
        let settled = self.judged.partition_point(|(m, _)| m.query < self.of_map + first);
        if settled + matches.len() <= self.judged.len() {
            return None;
        }
        // A map that is found to be a known one is told in that at once.
        if newest_m - self.corrected_m < options.least_correction_m && !self.joins_map(&matches) {
            return None;
        }
        self.corrected_m = newest_m;
        let revision = self.correct(&matches, first, view, settings);
        let (before, rows) =
            (first.saturating_sub(options.overlap_keyframes), (&mut self.trajectory, &mut self.corrected));
        let judged = (&mut self.judged, &mut self.loops);
        self.settled.settle((before, self.of_map), &mut self.search, rows, judged);
        drop(self.reported.forget_before(self.settled.first));
        revision
    }

    /// True where the newest match is the first of its map that holds.
    fn joins_map(&self, matches: &[PlaceMatch]) -> bool {
        let segment = |m: &PlaceMatch| self.search.keyframes()[m.query].segment;
        let Some(newest) = matches.last().map(segment) else { return false };
        !self.judged.iter().rev().any(|(m, (_, holds))| *holds && segment(m) == newest)
    }

    /// The first keyframe that the next correction moves.
    fn first_moved(&self, options: &AdvancedOnlineOptions) -> usize {
        let seen_again = self.judged.iter().rev().find(|(_, (_, holds))| *holds);
        let settled = self.settled.first;
        let last = seen_again.map_or(settled, |(m, _)| m.query - self.of_map);
        let by_count = self.own().saturating_sub(options.least_corrected_keyframes);
        let first = last.saturating_sub(options.overlap_keyframes).min(by_count);
        // Those before were never corrected.
        first.min(self.corrected.len().saturating_sub(1)).max(settled)
    }

    /// Row of the newest keyframe of the drive.
    fn last_row(&self) -> Option<usize> {
        (self.own() > 0).then(|| self.search.keyframes().last().map(|k| k.frame))?
    }

    /// True while the next keyframe belongs to a map that has just begun and whose scale is a guess.
    fn waits(&self, newest: &EgoFrame, view: &FrontEndView<'_>, settings: &Settings) -> bool {
        let young_s = settings.config.loops.advanced.young_s;
        let (Some(next), Some(now)) = (view.places.get(self.own()), view.frames.last()) else { return false };
        let since_s = (now.timestamp_ns - view.frames[next.frame].timestamp_ns) as f64 * 1e-9;
        since_s < young_s && guessed(newest, settings.config.scale.advanced.metric.unknown_scale_sigma)
    }

    fn push(&mut self, newest: &EgoFrame, settings: &Settings) {
        let step_m = self.ego.last().map_or(0.0, |before| {
            (newest.world_from_camera.translation() - before.world_from_camera.translation()).norm()
        });
        self.way_m.push(self.way_m.last().unwrap_or(&0.0) + step_m);
        self.ego.push(newest.clone());
        let unknown_sigma = settings.config.scale.advanced.metric.unknown_scale_sigma;
        rescale(&mut self.ego, &mut self.way_m, unknown_sigma);
        self.offsets.push(newest);
    }

    /// Looks for the next keyframe.
    fn take(&mut self, view: &FrontEndView<'_>, settings: &Settings) -> Option<()> {
        let places = view.places;
        let k = self.own();
        let reach = settings.config.places.advanced.landmarks.neighbours;
        let from = k.saturating_sub(reach);
        let around = &places[from..(k + reach + 1).min(places.len())];
        let placement = |row: usize| FramePlacement {
            world_from_camera: self.ego[row].world_from_camera,
            covariance: self.ego[row].covariance,
            way_m: self.way_m[row],
        };
        let options = &settings.config.places;
        let placed = place_keyframe(&settings.camera, around, k - from, placement, options)?;
        self.trajectory.push(self.step_to(placed.frame, settings)?);
        self.times_ns.push(view.frames[placed.frame].timestamp_ns);
        let reported = self.offsets.at(placed.frame) * self.ego[placed.frame].world_from_camera;
        self.reported.push(reported);
        let needed = places.get((k + 1).saturating_sub(reach)).map_or(placed.frame, |first| first.frame);
        // The step to the next keyframe starts at this one.
        let needed = needed.min(placed.frame);
        drop(self.ego.forget_before(needed));
        drop(self.way_m.forget_before(needed));
        self.search.take(placed, |later, earlier, found| within_drift(found, (later, earlier), settings));
        Some(())
    }

    /// The camera of the next keyframe, with the step from the one before.
    fn step_to(&self, row: usize, settings: &Settings) -> Option<EgoFrame> {
        let Some(before) = self.last_row() else { return Some(self.ego[row].clone()) };
        let frames = (before..=row).map(|row| self.ego[row].clone()).collect();
        let way = EgoTrajectory { frames, height_m: settings.height_m, noise: Vec::new() };
        way.of_rows(&[0, row.checked_sub(before)?]).frames.pop()
    }

    /// Closes the loops among the keyframes from `first` on; `None` where no loop holds or the graph was not solved.
    fn correct(
        &mut self,
        matches: &[PlaceMatch],
        first: usize,
        view: &FrontEndView<'_>,
        settings: &Settings,
    ) -> Option<Revision> {
        let (config, of_map) = (&settings.config, self.of_map);
        let keyframes = self.search.keyframes();
        let rows: Vec<usize> = keyframes.since(of_map + first).map(|k| k.frame).collect();
        let last = self.trajectory.last()?.world_from_camera;
        let matched = Matched { keyframes, of_map, matches };
        let camera = |keyframe: usize| keyframe.checked_sub(of_map + first);
        let corrected = |k: usize| self.corrected.get(k).or_else(|| self.settled.pose(k));
        let known = |keyframe: usize| match keyframe.checked_sub(of_map).and_then(corrected) {
            Some(corrected) => *corrected,
            None => (keyframes[keyframe].world_from_camera, keyframes[keyframe].covariance),
        };
        let mut edges = matched.edges(camera, known);
        let mut moved = EgoTrajectory {
            frames: self.trajectory[first..].to_vec(),
            height_m: settings.height_m,
            noise: Vec::new(),
        };
        if first > 0 {
            self.hold_first(first, &mut moved, &mut edges);
        }
        let solved = close_loops(
            &mut moved,
            &edges,
            &config.loops,
            &solve(settings, &self.times_ns[first..], Stop::NEVER),
        );
        let report = match solved {
            Ok(report) => report,
            Err(error) => {
                self.loops.problem = Some(error.to_string());
                return None;
            }
        };
        let report = LoopReport { map: report.map.get(usize::from(first > 0)..)?.to_vec(), ..report };
        let verdicts = matched.verdicts(camera, &report);
        self.judged.truncate(self.judged.partition_point(|(m, _)| m.query < of_map + first));
        let from = rows.first().copied().unwrap_or(0);
        self.loops.all.truncate(self.loops.all.partition_point(|l| l.edge.later < from));
        if let Some(kept) = &mut self.loops.kept {
            kept.matches.truncate(kept.matches.partition_point(|m| m.edge.frame < from));
        }
        matched.put_down(&mut self.loops, &verdicts);
        self.judged.extend(matches.iter().cloned().zip(verdicts));
        let counts = self.search.report();
        (self.loops.keyframes, self.loops.candidates) = (self.own(), counts.candidates);
        (self.loops.verified, self.loops.odometry_factor) = (counts.verified, report.odometry_factor);
        self.loops.most_moved_m = report.most_moved_m;
        let counts = self.settled.counts.with(&self.judged, of_map);
        if counts.closed + counts.by_map == 0 {
            return None;
        }
        self.corrected.truncate(first);
        moved.frames.iter().for_each(|f| self.corrected.push((f.world_from_camera, f.covariance)));
        let newest = view.frames.len() - 1;
        if let Some(kept) = self.loops.kept.as_mut().filter(|kept| kept.met()) {
            kept.first_estimated_frame.get_or_insert(newest);
        }
        let corrected = moved.frames.last()?;
        let offset = corrected.world_from_camera * last.inverse();
        let before = self.offsets.at(newest);
        let cameras: Vec<EgoFrame> = (self.last_row()?..=newest).map(|row| self.ego[row].clone()).collect();
        let known = Uncertainty::of(corrected.covariance, cameras.first()?);
        self.offsets.add(newest, offset, known, &cameras);
        self.revisions += 1;
        Some(Revision {
            number: self.revisions,
            frame: view.frames[newest].clone(),
            closed: counts.closed,
            switched_off: counts.of_drive - counts.closed,
            by_map: self.loops.kept.is_some().then_some(counts.by_map),
            corrected_from_reported: offset * before.inverse(),
            keyframes: self.revised(&moved, (first, &rows), view, &config.online.advanced),
        })
    }

    /// Puts the keyframes from `first` on where the last correction has the first of them, which is held to that.
    fn hold_first(&self, first: usize, moved: &mut EgoTrajectory, edges: &mut PlaceEdges) {
        let (Some((pose, covariance)), Some(before)) = (self.corrected.get(first), moved.frames.first())
        else {
            return;
        };
        let offset = *pose * before.world_from_camera.inverse();
        for frame in &mut moved.frames {
            frame.world_from_camera = offset * frame.world_from_camera;
        }
        edges.map.insert(
            0,
            MapEdge {
                frame: 0,
                world_from_keyframe: *pose,
                keyframe_covariance: *covariance,
                camera_from_keyframe: Pose::identity(),
                covariance: Matrix6::zeros(),
            },
        );
    }

    /// Ends the drive: the loops of the last correction, and the places of the drive as all matches correct them, unless asked to stop. A warning where temporary files
    /// did not read back: only the newest loops are listed then, and no places are kept.
    pub(super) fn finish(self, settings: &Settings, stop: Stop<'_>) -> (Loops, Option<String>) {
        let Self { mut loops, of_map, mut search, mut trajectory, .. } = self;
        if let Err(error) = self.settled.give_back(&mut search, &mut trajectory, &mut loops) {
            return (loops, Some(not_read_back("places of the drive", &error)));
        }
        let (found, config) = (search.finish(), &settings.config);
        let matched = Matched { keyframes: &found.keyframes, of_map, matches: &found.matches };
        let known = |k: usize| (found.keyframes[k].world_from_camera, found.keyframes[k].covariance);
        let edges = matched.edges(|keyframe| keyframe.checked_sub(of_map), known);
        let frames = trajectory.into_kept();
        let mut ego = EgoTrajectory { frames, height_m: settings.height_m, noise: Vec::new() };
        if let Err(error) =
            close_loops(&mut ego, &edges, &config.loops, &solve(settings, &self.times_ns, stop))
        {
            // The poses of before stand.
            loops.problem = Some(error.to_string());
        }
        let mut keyframes = found.keyframes;
        let mut own = keyframes.split_off(of_map);
        for (keyframe, frame) in own.iter_mut().zip(&ego.frames) {
            (keyframe.world_from_camera, keyframe.covariance) = (frame.world_from_camera, frame.covariance);
        }
        join(&mut own, &loops);
        loops.map = Some(PlaceMap { camera: settings.camera, height_m: settings.height_m, keyframes: own });
        (loops, None)
    }

    /// The keyframes that stand elsewhere than reported last; they are reported now.
    fn revised(
        &mut self,
        moved: &EgoTrajectory,
        (first, rows): (usize, &[usize]),
        view: &FrontEndView<'_>,
        options: &AdvancedOnlineOptions,
    ) -> Vec<RevisedKeyframe> {
        let mut out = Vec::new();
        for ((frame, reported), row) in moved.frames.iter().zip(&mut self.reported[first..]).zip(rows) {
            let off = reported.inverse() * frame.world_from_camera;
            let (moved_m, turned_rad) = (off.translation().norm(), off.rotation().angle());
            if moved_m > options.least_move_m || turned_rad > options.least_move_rad {
                *reported = frame.world_from_camera;
                out.push(RevisedKeyframe {
                    number: view.frames[*row].number,
                    world_from_camera: frame.world_from_camera,
                    covariance: frame.covariance,
                });
            }
        }
        out
    }
}

#[cfg(test)]
mod tests;
