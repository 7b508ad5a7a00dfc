//! Keyframes that no correction moves any more, and their matches.

mod state;

use std::collections::BTreeMap;
use std::io;

use motorcade_odometry::{EgoFrame, Rows};
use motorcade_places::{PlaceMatch, PlaceSearch, PlacedKeyframe};

use crate::archive::Archive;
use crate::closed_loop::{ClosedLoop, Loops};
use crate::estimator::place_edges::{KnownPose, Verdict};
use crate::kept_map::MapMatch;

pub(super) use state::SettledState;

/// Settled keyframes: what the end of a drive needs of them, in temporary files, and the poses that later keyframes need.
#[derive(Default)]
pub(super) struct Settled {
    /// Keyframes of the drive before this one are settled.
    pub(super) first: usize,
    /// Poses by the last correction of those that can be seen again.
    places: BTreeMap<usize, KnownPose>,
    /// Matches among the settled ones.
    pub(super) counts: Counts,
    cameras: Archive<EgoFrame>,
    keyframes: Archive<(usize, PlacedKeyframe)>,
    matches: Archive<PlaceMatch>,
    loops: Archive<ClosedLoop>,
    by_map: Archive<MapMatch>,
}

/// Matches that were judged.
#[derive(Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Counts {
    /// With places of the drive.
    pub(super) of_drive: usize,
    /// Those of them that hold.
    pub(super) closed: usize,
    /// With places of the kept map, those that hold.
    pub(super) by_map: usize,
}

impl Counts {
    /// With more matches.
    pub(super) fn with<'a>(
        mut self,
        judged: impl IntoIterator<Item = &'a (PlaceMatch, Verdict)>,
        of_map: usize,
    ) -> Self {
        for (m, (_, holds)) in judged {
            let (of_drive, holds) = (usize::from(m.candidate >= of_map), usize::from(*holds));
            self.of_drive += of_drive;
            self.closed += of_drive * holds;
            self.by_map += (1 - of_drive) * holds;
        }
        self
    }
}

impl Settled {
    /// Pose of a settled keyframe that can be seen again, by the last correction.
    pub(super) fn pose(&self, keyframe: usize) -> Option<&KnownPose> {
        self.places.get(&keyframe)
    }

    /// Settles the keyframes of the drive before `before`. The first `of_map` keyframes of the search are those of the kept map.
    pub(super) fn settle(
        &mut self,
        (before, of_map): (usize, usize),
        search: &mut PlaceSearch,
        (cameras, corrected): (&mut Rows<EgoFrame>, &mut Rows<KnownPose>),
        (judged, loops): (&mut Vec<(PlaceMatch, Verdict)>, &mut Loops),
    ) {
        let cameras: Vec<EgoFrame> = cameras.forget_before(before).collect();
        // Nothing while it is not worth the work.
        if cameras.is_empty() {
            return;
        }
        let before = self.first + cameras.len();
        let poses: Vec<KnownPose> = corrected.forget_before(before).collect();
        let kept = |k: &usize| search.can_be_found(of_map + k);
        self.places.extend((self.first..).zip(poses).filter(|(k, _)| kept(k)));
        let old = judged.partition_point(|(m, _)| m.query < of_map + before);
        self.counts = self.counts.with(judged.drain(..old).as_slice(), of_map);
        let frame = search.keyframes().get(of_map + before).map_or(0, |k| k.frame);
        let old = loops.all.partition_point(|l| l.edge.later < frame);
        self.loops.put_away(loops.all.drain(..old).collect());
        if let Some(kept) = &mut loops.kept {
            let old = kept.matches.partition_point(|m| m.edge.frame < frame);
            self.by_map.put_away(kept.matches.drain(..old).collect());
        }
        let (keyframes, matches) = search.take_out(of_map + before);
        self.keyframes.put_away(keyframes);
        self.matches.put_away(matches);
        self.cameras.put_away(cameras);
        self.first = before;
    }

    /// Puts all back where it was.
    ///
    /// # Errors
    /// A temporary file that does not read back.
    pub(super) fn give_back(
        mut self,
        search: &mut PlaceSearch,
        cameras: &mut Rows<EgoFrame>,
        loops: &mut Loops,
    ) -> io::Result<()> {
        search.put_back(self.keyframes.take_back()?, self.matches.take_back()?);
        cameras.put_back(self.cameras.take_back()?);
        drop(loops.all.splice(..0, self.loops.take_back()?));
        let by_map = self.by_map.take_back()?;
        if let Some(kept) = &mut loops.kept {
            drop(kept.matches.splice(..0, by_map));
        }
        Ok(())
    }

    /// Makes a file one that cannot be read, as of a disk that broke.
    #[cfg(test)]
    pub(super) fn break_file(&mut self) {
        self.matches.break_file();
    }
}
