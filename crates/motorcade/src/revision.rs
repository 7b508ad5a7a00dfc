//! Corrections of an online run by places seen again, or known from a kept map.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Matrix6;
use serde_json::{Value, json};

use crate::estimate;
use crate::record::FrameInfo;

/// A correction of an online run: places seen again show where the camera is and was. Estimates returned before stay as they are.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Revision {
    /// Number of the correction, from 1.
    pub number: usize,
    /// The first frame that is estimated in the corrected world.
    pub frame: FrameInfo,
    /// Loops that hold.
    pub closed: usize,
    /// Loops that odometry and the others contradict.
    pub switched_off: usize,
    /// Keyframes that see a place of the kept map; `None` in runs without one. With any of them the corrected world is that of the map.
    pub by_map: Option<usize>,
    /// Difference between this frame's pose with and without the correction.
    pub corrected_from_reported: Pose<World, World>,
    /// Keyframes that stand elsewhere than reported last.
    pub keyframes: Vec<RevisedKeyframe>,
}

/// A keyframe where a correction puts it.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct RevisedKeyframe {
    /// Number of the frame.
    pub number: u64,
    /// Pose in the corrected world \[m\].
    pub world_from_camera: Pose<World, Camera>,
    /// Its covariance (6×6 `[ω, ν]`).
    pub covariance: Matrix6<f64>,
}

impl Revision {
    /// One line of JSON: `revision`, `frame`, `time_s`, `loops`, `corrected_from_reported`, `keyframes`; `map` in runs with a kept map.
    pub fn to_json(&self) -> String {
        let keyframe = |k: &RevisedKeyframe| {
            let mut out = estimate::pose(&k.world_from_camera, &k.covariance);
            out["frame"] = json!(k.number);
            out
        };
        let keyframes: Vec<Value> = self.keyframes.iter().map(keyframe).collect();
        let (t, q) = (self.corrected_from_reported.translation(), self.corrected_from_reported.rotation());
        let mut line = json!({
            "revision": self.number,
            "frame": self.frame.number,
            "time_s": estimate::rounded(self.frame.timestamp_ns as f64 * 1e-9),
            "loops": {"closed": self.closed, "switched_off": self.switched_off},
            "corrected_from_reported": {
                "position_m": ([t.x, t.y, t.z].map(estimate::rounded)),
                "orientation_xyzw": ([q.i, q.j, q.k, q.w].map(estimate::rounded)),
            },
            "keyframes": keyframes,
        });
        if let Some(matches) = self.by_map {
            line["map"] = json!({"matches": matches});
        }
        line.to_string()
    }
}
