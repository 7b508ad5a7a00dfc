//! A map of places that an earlier drive kept, and how a drive met it.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use motorcade_dataset::{Fnv, regular_file};
use motorcade_multibody::MapEdge;
use motorcade_places::PlaceMap;

use crate::error::{Error, Result};

/// A map of places that an earlier drive kept.
#[derive(Clone, Debug)]
pub struct KeptMap {
    /// The map.
    pub map: Arc<PlaceMap>,
    /// Hash of its file.
    pub digest: String,
    /// Size of its file \[bytes\].
    pub bytes: usize,
}

impl KeptMap {
    /// Reads a file of `run --save-map`.
    ///
    /// # Errors
    /// A file that cannot be read or is no map, by name and reason.
    pub fn read(path: &Path) -> Result<Self> {
        let problem = |e: &dyn fmt::Display| Error::Input(format!("{}: {e}", path.display()));
        let bytes = regular_file::read(path).map_err(|e| problem(&e))?;
        let map = PlaceMap::from_bytes(&bytes).map_err(|e| problem(&e))?;
        Ok(Self { map: Arc::new(map), digest: Fnv::of(&bytes).to_string(), bytes: bytes.len() })
    }
}

/// A frame that sees a place of a kept map.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct MapMatch {
    /// Frame (row of the run), pose relative to the map's keyframe, covariance.
    pub edge: MapEdge,
    /// Row of that keyframe in the run that kept the map.
    pub map_frame: usize,
    /// Landmarks that agree with the relative pose.
    pub inliers: usize,
    /// Their share of the landmarks in view.
    pub share: f64,
    /// Root mean square reprojection error of the inliers \[px of their level\].
    pub rms_px: f64,
    /// Weight in the graph, 0 to 1.
    pub weight: f64,
    /// False where odometry and the others switched it off.
    pub holds: bool,
}

/// A kept map in a drive.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct MapUse {
    /// Hash of the map's file.
    pub digest: String,
    /// Keyframes of the map.
    pub keyframes: usize,
    /// Frames that see a place of the map, in order.
    pub matches: Vec<MapMatch>,
    /// In an online run the first frame (row) that is estimated in the world of the map; `None` before it was met, and of whole drives, which
    /// are estimated in it from their beginning.
    pub first_estimated_frame: Option<usize>,
}

impl MapUse {
    /// A map that was not met yet.
    pub(crate) fn of(kept: &KeptMap) -> Self {
        Self {
            digest: kept.digest.clone(),
            keyframes: kept.map.keyframes.len(),
            matches: Vec::new(),
            first_estimated_frame: None,
        }
    }

    /// Matches that hold.
    pub fn held(&self) -> impl Iterator<Item = &MapMatch> {
        self.matches.iter().filter(|m| m.holds)
    }

    /// True where the map was met: the world of the drive is then that of the map.
    pub fn met(&self) -> bool {
        self.held().next().is_some()
    }
}

impl fmt::Display for MapUse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.held().next() {
            Some(first) => write!(
                f,
                "{} keyframes see places of the map, the first in row {}: poses are in the world of the map",
                self.held().count(),
                first.edge.frame
            ),
            None => write!(
                f,
                "no place of the map was seen: poses are in the world of this drive, whose first camera is its origin"
            ),
        }
    }
}
