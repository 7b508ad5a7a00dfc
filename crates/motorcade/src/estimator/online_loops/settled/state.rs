//! State of the settled keyframes, to be kept in a file.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Counts, Settled};
use crate::archive::{Archive, ArchiveState};
use crate::estimator::place_edges::KnownPose;

/// State of the settled keyframes between two frames.
#[derive(Serialize, Deserialize)]
pub(in crate::estimator::online_loops) struct SettledState {
    pub(in crate::estimator::online_loops) first: usize,
    places: BTreeMap<usize, KnownPose>,
    counts: Counts,
    cameras: ArchiveState,
    keyframes: ArchiveState,
    matches: ArchiveState,
    loops: ArchiveState,
    by_map: ArchiveState,
}

impl Settled {
    /// None yet, with files in a folder.
    pub(in crate::estimator::online_loops) fn named(folder: &Path) -> Self {
        Self {
            cameras: Archive::named(folder.join("settled_cameras")),
            keyframes: Archive::named(folder.join("settled_keyframes")),
            matches: Archive::named(folder.join("settled_matches")),
            loops: Archive::named(folder.join("settled_loops")),
            by_map: Archive::named(folder.join("settled_by_map")),
            ..Self::default()
        }
    }

    /// The state after the last frame.
    pub(in crate::estimator::online_loops) fn state(&self) -> io::Result<SettledState> {
        let Self { first, places, counts, cameras, keyframes, matches, loops, by_map } = self;
        Ok(SettledState {
            first: *first,
            places: places.clone(),
            counts: *counts,
            cameras: cameras.state()?,
            keyframes: keyframes.state()?,
            matches: matches.state()?,
            loops: loops.state()?,
            by_map: by_map.state()?,
        })
    }

    /// As in a state, with the files of this one.
    pub(in crate::estimator::online_loops) fn resumed(&self, state: SettledState) -> io::Result<Self> {
        let SettledState { first, places, counts, cameras, keyframes, matches, loops, by_map } = state;
        Ok(Self {
            first,
            places,
            counts,
            cameras: self.cameras.resumed(&cameras)?,
            keyframes: self.keyframes.resumed(&keyframes)?,
            matches: self.matches.resumed(&matches)?,
            loops: self.loops.resumed(&loops)?,
            by_map: self.by_map.resumed(&by_map)?,
        })
    }
}
