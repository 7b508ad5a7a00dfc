//! Loops of a drive.

use std::fmt;
use std::ops::RangeInclusive;

use motorcade_multibody::{LoopEdge, PlaceEdges};
use motorcade_places::PlaceMap;

use crate::kept_map::MapUse;

/// Two frames that see the same place.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ClosedLoop {
    /// Frames (rows of the run), relative pose and covariance.
    pub edge: LoopEdge,
    /// Landmarks that agree with the relative pose.
    pub inliers: usize,
    /// Their share of the landmarks in view.
    pub share: f64,
    /// Root mean square reprojection error of the inliers \[px of their level\].
    pub rms_px: f64,
    /// Weight in the graph, 0 to 1.
    pub weight: f64,
    /// False where odometry and the other loops switched it off.
    pub closed: bool,
}

/// Loops of a drive, and what was searched.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Loops {
    /// Keyframes of places.
    pub keyframes: usize,
    /// Candidates that looked alike.
    pub candidates: usize,
    /// Keyframes whose candidate was verified by geometry.
    pub verified: usize,
    /// Loops in order of their later frames.
    pub all: Vec<ClosedLoop>,
    /// Factor on the covariance of the odometry that the loops showed.
    pub odometry_factor: f64,
    /// Farthest that a camera was moved by the correction \[m\].
    pub most_moved_m: f64,
    /// Passes by standing vehicles that were joined to earlier passes by the same ones.
    pub vehicles_met_again: usize,
    /// A kept map that the drive was given, and where it was met.
    pub kept: Option<MapUse>,
    /// The places of the drive, in its corrected world; `None` of drives whose places are not kept.
    // Made at the end of a drive.
    #[serde(skip)]
    pub map: Option<PlaceMap>,
    /// Reason why the trajectory was not corrected, where it was not.
    pub problem: Option<String>,
}

impl Loops {
    /// Loops that hold.
    pub fn closed(&self) -> impl Iterator<Item = &ClosedLoop> {
        self.all.iter().filter(|l| l.closed)
    }

    /// True where a loop joins two spans of frames, each with `near` frames before and after it.
    pub(crate) fn join(
        &self,
        earlier: &RangeInclusive<usize>,
        later: &RangeInclusive<usize>,
        near: usize,
    ) -> bool {
        let in_span = |span: &RangeInclusive<usize>, frame: usize| {
            (span.start().saturating_sub(near)..=span.end().saturating_add(near)).contains(&frame)
        };
        self.closed().any(|l| in_span(earlier, l.edge.earlier) && in_span(later, l.edge.later))
    }

    /// Edges that hold.
    pub(crate) fn edges(&self) -> PlaceEdges {
        let map = self.kept.iter().flat_map(MapUse::held).map(|m| m.edge.clone()).collect();
        PlaceEdges { loops: self.closed().map(|l| l.edge.clone()).collect(), map }
    }

    /// True where the world is that of a kept map.
    pub fn in_world_of_map(&self) -> bool {
        self.kept.as_ref().is_some_and(MapUse::met)
    }

    /// Sentences for the user.
    pub(crate) fn describe(&self) -> impl Iterator<Item = String> {
        let any = !self.all.is_empty() || self.problem.is_some();
        let own = any.then(|| self.to_string());
        own.into_iter().chain(self.kept.iter().map(MapUse::to_string))
    }
}

impl fmt::Display for Loops {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(problem) = &self.problem {
            return write!(f, "the trajectory was not corrected by places seen again ({problem})");
        }
        let (closed, all) = (self.closed().count(), self.all.len());
        write!(
            f,
            "{closed} of {} keyframes see a place again: the camera was moved by up to {:.2} m",
            self.keyframes, self.most_moved_m
        )?;
        if closed < all {
            write!(f, "; {} more were contradicted and switched off", all - closed)?;
        }
        Ok(())
    }
}
