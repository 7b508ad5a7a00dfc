//! Matches of places as edges of a graph, and its verdicts as matches.

use std::ops::Index;

use motorcade_geometry::{Camera, Pose, World};
use motorcade_multibody::{LoopEdge, LoopReport, MapEdge, PlaceEdges};
use motorcade_places::{PlaceMatch, PlacedKeyframe};
use nalgebra::Matrix6;

use crate::closed_loop::{ClosedLoop, Loops};
use crate::kept_map::MapMatch;

/// Pose of a keyframe and its covariance.
pub(super) type KnownPose = (Pose<World, Camera>, Matrix6<f64>);

/// Keyframes with the matches among them; the first `of_map` keyframes are those of the kept map.
pub(super) struct Matched<'a, K> {
    pub(super) keyframes: &'a K,
    pub(super) of_map: usize,
    pub(super) matches: &'a [PlaceMatch],
}

/// Weight of a match in the graph, and whether it holds.
pub(super) type Verdict = (f64, bool);

impl<K: Index<usize, Output = PlacedKeyframe>> Matched<'_, K> {
    /// The matches as edges. `camera` names the camera of a keyframe of the drive in the graph; a keyframe without one is fixed where `known`
    /// has it.
    pub(super) fn edges(
        &self,
        camera: impl Fn(usize) -> Option<usize>,
        known: impl Fn(usize) -> KnownPose,
    ) -> PlaceEdges {
        let mut edges = PlaceEdges::default();
        for m in self.matches {
            let Some(later) = camera(m.query) else { continue };
            if let Some(earlier) = self.moving(m.candidate, &camera) {
                let (later_from_earlier, covariance) = (m.query_from_candidate, m.covariance);
                edges.loops.push(LoopEdge { earlier, later, later_from_earlier, covariance });
            } else {
                let (world_from_keyframe, keyframe_covariance) = known(m.candidate);
                let (frame, camera_from_keyframe) = (later, m.query_from_candidate);
                let covariance = m.covariance;
                edges.map.push(MapEdge {
                    frame,
                    world_from_keyframe,
                    keyframe_covariance,
                    camera_from_keyframe,
                    covariance,
                });
            }
        }
        edges
    }

    fn moving(&self, keyframe: usize, camera: &impl Fn(usize) -> Option<usize>) -> Option<usize> {
        camera(keyframe).filter(|_| keyframe >= self.of_map)
    }

    /// The verdict of the graph on each match, of which [`edges`](Self::edges) with the same `camera` made the edges.
    pub(super) fn verdicts(
        &self,
        camera: impl Fn(usize) -> Option<usize>,
        report: &LoopReport,
    ) -> Vec<Verdict> {
        let mut loops = report.weights.iter().copied().zip(report.closed.iter().copied());
        let mut map = report.map.iter().copied();
        let mut verdict = |m: &PlaceMatch| match self.moving(m.candidate, &camera) {
            Some(_) => loops.next(),
            None => map.next(),
        };
        self.matches.iter().map(|m| verdict(m).unwrap_or((0.0, false))).collect()
    }

    /// Adds the matches with their verdicts to those that are put down already.
    pub(super) fn put_down(&self, loops: &mut Loops, verdicts: &[Verdict]) {
        for (m, (weight, holds)) in self.matches.iter().zip(verdicts) {
            let (later, earlier) = (&self.keyframes[m.query], &self.keyframes[m.candidate]);
            let (weight, holds, covariance) = (*weight, *holds, m.covariance);
            let (inliers, share, rms_px) = (m.inliers, m.share, m.rms_px);
            if m.candidate >= self.of_map {
                let edge = LoopEdge {
                    earlier: earlier.frame,
                    later: later.frame,
                    later_from_earlier: m.query_from_candidate,
                    covariance,
                };
                loops.all.push(ClosedLoop { edge, inliers, share, rms_px, weight, closed: holds });
            } else if let Some(kept) = &mut loops.kept {
                let edge = MapEdge {
                    frame: later.frame,
                    world_from_keyframe: earlier.world_from_camera,
                    keyframe_covariance: earlier.covariance,
                    camera_from_keyframe: m.query_from_candidate,
                    covariance,
                };
                let map_frame = earlier.frame;
                kept.matches.push(MapMatch { edge, map_frame, inliers, share, rms_px, weight, holds });
            }
        }
    }
}
