//! State of the places seen again while the camera drives, to be kept in a file.

use std::io;
use std::path::Path;

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{EgoFrame, Rows};
use motorcade_places::{PlaceMatch, PlaceSearchState};
use serde::{Deserialize, Serialize};

use super::settled::{Settled, SettledState};
use super::{Offsets, OnlineLoops};
use crate::closed_loop::Loops;
use crate::estimator::place_edges::{KnownPose, Verdict};

/// State of [`OnlineLoops`] between two frames, without what the settings give.
#[derive(Serialize, Deserialize)]
pub(in crate::estimator) struct OnlineLoopsState<'a> {
    search: PlaceSearchState<'a>,
    ego: Rows<EgoFrame>,
    way_m: Rows<f64>,
    trajectory: Rows<EgoFrame>,
    times_ns: Vec<i64>,
    judged: Vec<(PlaceMatch, Verdict)>,
    corrected: Rows<KnownPose>,
    settled: SettledState,
    corrected_m: f64,
    reported: Rows<Pose<World, Camera>>,
    offsets: Offsets,
    loops: Loops,
    revisions: usize,
}

impl OnlineLoops {
    /// Has settled keyframes put away in files of a folder; before the first frame.
    pub(in crate::estimator) fn put_rows_in(&mut self, folder: &Path) {
        self.settled = Settled::named(folder);
    }

    /// The state after the last frame.
    ///
    /// # Errors
    /// Keyframes that could not be put away in a file with a name.
    pub(in crate::estimator) fn state(&self) -> io::Result<OnlineLoopsState<'_>> {
        // A field that is new does not compile here until it is kept or known to be no state.
        let Self {
            search,
            of_map: _,
            ego,
            way_m,
            trajectory,
            times_ns,
            judged,
            corrected,
            settled,
            corrected_m,
            reported,
            offsets,
            loops,
            revisions,
        } = self;
        Ok(OnlineLoopsState {
            search: search.state(),
            ego: ego.clone(),
            way_m: way_m.clone(),
            trajectory: trajectory.clone(),
            times_ns: times_ns.clone(),
            judged: judged.clone(),
            corrected: corrected.clone(),
            settled: settled.state()?,
            corrected_m: *corrected_m,
            reported: reported.clone(),
            offsets: offsets.clone(),
            loops: loops.clone(),
            revisions: *revisions,
        })
    }

    /// As in a state after so many rows, with the settings and the files of this one, which has taken no frame.
    ///
    /// # Errors
    /// A state that does not fit together, or whose files are not as they were.
    pub(in crate::estimator) fn resumed(&self, state: OnlineLoopsState<'_>, rows: usize) -> io::Result<Self> {
        let OnlineLoopsState {
            search,
            ego,
            way_m,
            trajectory,
            times_ns,
            judged,
            corrected,
            settled,
            corrected_m,
            reported,
            offsets,
            loops,
            revisions,
        } = state;
        let problem = || io::Error::other("its places do not fit together");
        let same_map = self.loops.kept.as_ref().map(|k| &k.digest) == loops.kept.as_ref().map(|k| &k.digest);
        let settled = self.settled.resumed(settled)?;
        let search = self.search.clone().resumed(search).ok_or_else(problem)?;
        let own = search.keyframes().len().checked_sub(self.of_map).ok_or_else(problem)?;
        let of_keyframes = [trajectory.len(), times_ns.len(), reported.len()];
        let of_drive = |(m, _): &(PlaceMatch, Verdict)| (self.of_map..self.of_map + own).contains(&m.query);
        if !same_map
            || of_keyframes != [own; 3]
            || [ego.len(), way_m.len()] != [rows; 2]
            || ego.first_kept() != way_m.first_kept()
            || settled.first > own
            || corrected.len() > own
            || !judged.iter().all(of_drive)
        {
            return Err(problem());
        }
        Ok(Self {
            search,
            of_map: self.of_map,
            ego,
            way_m,
            trajectory,
            times_ns,
            judged,
            corrected,
            settled,
            corrected_m,
            reported,
            offsets,
            loops,
            revisions,
        })
    }
}
